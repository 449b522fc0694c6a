"""Foreign pages in a real browser, whose user is at home in the studio, get nothing of it."""

import http.server
import logging
import threading

import pytest

from studio.pretended import PretendedStage, running
from support.browsers import NEEDED, started

pytestmark = NEEDED

# Each attempt tells whether it got anything; that of another page is closed before it opens.
ATTEMPTS = """async (home) => {
  const settled = (begin) => new Promise((done) => begin(done));
  const element = (name, url) => settled((done) => {
    const one = document.createElement(name);
    one.onload = () => done("loaded");
    one.onerror = () => done("refused");
    one.src = url;
    document.body.append(one);
  });
  return {
    websocket: await settled((done) => {
      const socket = new WebSocket(home.replace("http", "ws") + "/live");
      socket.onopen = () => done("opened");
      socket.onerror = () => done("refused");
    }),
    fetch: await fetch(home + "/").then(() => "read", () => "refused"),
    opaque: await fetch(home + "/", { mode: "no-cors", credentials: "include" })
      .then(() => "sent", () => "refused"),
    post: await fetch(home + "/", { method: "POST", body: "x", mode: "no-cors" })
      .then(() => "sent", () => "refused"),
    script: await element("script", home + "/assets/studio.js"),
    image: await element("img", home + "/assets/studio.js"),
  };
}"""

# What stands in a report might do the same, if somebody's name in it became a script.
REPORT = """const told = (async () => ({
  origin: self.origin,
  websocket: await new Promise((done) => {
    try {
      const socket = new WebSocket(location.href.replace("http", "ws").replace(/runs.*/, "live"));
      socket.onopen = () => done("opened");
      socket.onerror = () => done("refused");
    } catch { done("refused"); }
  }),
  fetch: await fetch("/").then(() => "read", () => "refused"),
  cookie: (() => { try { return document.cookie; } catch { return "refused"; } })(),
}))();"""


@pytest.fixture(scope="module")
def browser():
    with started() as found:
        yield found


@pytest.fixture
def foreign(tmp_path):
    """A page of somebody else's on this machine, which is the worst place it can come from."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    (tmp_path / "index.html").write_text("<!doctype html><body></body>", encoding="utf-8")
    with http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), lambda *given: Quiet(*given, directory=tmp_path)
    ) as serving:
        threading.Thread(target=serving.serve_forever).start()
        yield serving.server_address[1]
        serving.shutdown()


# Ports are no part of a site: the cookie goes along from the first, and not from the second.
@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_a_foreign_page_reaches_nothing(name, browser, foreign, caplog):
    caplog.set_level(logging.WARNING, "phasmid.studio")
    with running() as studio:
        context = browser.new_context()
        page = context.new_page()
        assert page.goto(studio.server.address).status == 200
        page.goto(f"http://{name}:{foreign}/")
        got = page.evaluate(ATTEMPTS, studio.origin)
        assert got == dict.fromkeys(got, "refused")
        page.set_content(f'<iframe src="{studio.origin}/"></iframe>')
        page.wait_for_load_state("networkidle")
        assert [frame.url for frame in page.frames[1:]] == ["chrome-error://chromewebdata/"]
        context.close()
        assert studio.stage.asked.empty()
    lines = [record.getMessage() for record in caplog.records]
    assert f"refused a request of origin http://{name}:{foreign}." in lines


def test_a_report_cannot_speak_to_the_robot_in_our_name(browser, tmp_path):
    (tmp_path / "report.html").write_text(
        f"<!doctype html><script>{REPORT}</script>",
        encoding="utf-8",
    )
    with running(PretendedStage({"r-1": tmp_path})) as studio:
        context = browser.new_context()
        page = context.new_page()
        page.goto(studio.server.address)
        assert page.goto(f"{studio.origin}/runs/r-1/report.html").status == 200
        refused = dict.fromkeys(["websocket", "fetch", "cookie"], "refused")
        assert page.evaluate("told") == {"origin": "null"} | refused
        context.close()
