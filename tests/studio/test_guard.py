"""Access to the live page: each protection, through a real socket."""

import logging
import sys

import pytest
from websockets.exceptions import InvalidStatus

from phasmid.studio.server import listen
from studio.pretended import TOKEN, PretendedStage, running


@pytest.fixture(scope="module")
def studio():
    with running() as one:
        yield one


@pytest.fixture
def told(caplog):
    caplog.set_level(logging.WARNING, "phasmid.studio")
    return caplog


def test_nothing_listens_beyond_this_machine(studio):
    # 0.0.0.0 would be every address of the machine.
    assert studio.bound[0] == "127.0.0.1"


def test_the_page_is_served_with_a_policy_that_admits_nothing_foreign(studio):
    page = studio.get("/")
    assert page.status == 200
    assert page.text.startswith("<!doctype html>")
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    policy = page.headers["content-security-policy"].split("; ")
    assert policy[0] == "default-src 'none'"
    assert {"script-src 'self'", "connect-src 'self'", "frame-ancestors 'none'"} <= set(policy)
    assert "unsafe" not in page.headers["content-security-policy"]
    assert page.headers["x-content-type-options"] == "nosniff"
    assert page.headers["cache-control"] == "no-store"
    assert page.headers["cross-origin-resource-policy"] == "same-origin"
    assert page.headers["referrer-policy"] == "no-referrer"
    assert not [name for name in page.headers if name.startswith("access-control")]
    assert "server" not in page.headers


def test_the_address_with_the_token_lets_a_browser_in(studio):
    first = studio.get(f"/?token={TOKEN}", cookie="")
    assert (first.status, first.headers["location"]) == (303, "/")
    cookie, *rules = first.headers["set-cookie"].split("; ")
    assert {rule.lower() for rule in rules} == {"httponly", "samesite=strict", "path=/"}
    assert studio.get("/", cookie=cookie).status == 200
    # Cookies know no ports: another studio on this machine has its own.
    assert cookie.startswith(f"phasmid-{studio.port}=")
    assert studio.server.address == f"http://127.0.0.1:{studio.port}/?token={TOKEN}"


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:1", "null", "", "https://{host}"]
)
def test_a_websocket_of_another_page_is_refused_with_one_line(studio, told, origin):
    given = origin.format(host=studio.host)
    with pytest.raises(InvalidStatus) as refused, studio.open(origin=given):
        pass
    assert refused.value.response.status_code == 403
    assert refused.value.response.body == b"forbidden.\n"
    assert len(told.records) == 1
    assert "\n" not in told.records[0].getMessage()


def test_an_origin_that_drives_a_terminal_does_not_reach_it(studio, told):
    # Bytes above 127 are let through by HTTP; 0x9b begins a terminal's command.
    assert studio.get("/", Origin="http://\x9b31m.example").status == 403
    assert "\x9b" not in told.text
    assert "�" in told.text


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "127.0.0.1",
        "127.0.0.1:1",
        "127.0.0.1.:{port}",
        "127.0.0.1:{port}.evil.example",
        "127.0.0.1:{port}@evil.example",
        "localhost:{port},evil.example",
        "[::1]:{port}",
        "0.0.0.0:{port}",
        "2130706433:{port}",
    ],
)
def test_another_host_is_refused(studio, told, host):
    answer = studio.get("/", host=host.format(port=studio.port))
    assert (answer.status, answer.text) == (403, "forbidden.")
    assert len(told.records) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has all of 127.0.0.0/8")
@pytest.mark.parametrize(
    ("host", "status"),
    [("127.0.0.2", 200), ("localhost", 200), ("127.0.0.3", 403), ("0.0.0.0", 403)],
)
def test_the_machine_may_be_called_by_the_address_at_which_a_request_arrives(host, status):
    with running(listening=listen("0.0.0.0", 0), host="0.0.0.0") as wide:
        assert wide.get("/", host=f"{host}:{wide.port}", to="127.0.0.2").status == status


@pytest.mark.parametrize(
    "cookie", ["a=b", "phasmid-{port}=", "phasmid-{port}=wrong", "phasmid-1={token}", "{token}"]
)
@pytest.mark.parametrize("path", ["/", "/assets/studio.js", "/runs/r-7f3a/report.html"])
def test_without_the_token_there_is_nothing(studio, path, cookie):
    answer = studio.get(path, cookie=cookie.format(port=studio.port, token=TOKEN))
    assert answer.status == 401
    assert answer.text == "open the address that phasmid studio printed: it carries the token."
    assert answer.headers["x-content-type-options"] == "nosniff"
    with pytest.raises(InvalidStatus, match="401"), studio.open(cookie="a=b"):
        pass


@pytest.mark.parametrize("query", ["token=", "token=wrong", f"token={TOKEN}&x=1", "x=1", "token"])
def test_a_wrong_token_opens_nothing(studio, query):
    answer = studio.get(f"/?{query}", cookie="")
    assert answer.status == 401
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize(
    "path",
    [
        "/../../etc/passwd",
        "/assets/../../../etc/passwd",
        "/assets/%2e%2e/%2e%2e/etc/passwd",
        "/assets/..%2f..%2fetc%2fpasswd",
        "/assets/..%5c..%5cwindows",
        "/assets/%252e%252e%252fetc%252fpasswd",
        "/assets/studio.js%00.png",
        "/assets/studio.js/",
        "/assets/",
        "/assets",
        "//etc/passwd",
        "/studio.html",
        "/runs/",
        "/runs/r-7f3a/../../x",
        "/runs/r-7f3a/%2e%2e",
        "/runs/r-7f3a//report.html",
        "/" + 9000 * "a",
    ],
)
def test_only_what_stands_in_the_table_is_found(studio, path):
    assert studio.get(path).status == 404


def test_a_recording_is_read_from_its_folder_and_from_nowhere_else(tmp_path):
    # Larger than all buffers on its way, so that it is sent in parts.
    content = bytes(range(256)) * 20_000
    (tmp_path / "recording.nc").write_bytes(content)
    (tmp_path / "report.html").write_bytes(b"<p>report")
    (tmp_path / "secret.txt").write_bytes(b"secret")
    with running(PretendedStage({"r-1": tmp_path})) as studio:
        data = studio.get("/runs/r-1/recording.nc")
        assert (data.status, data.body) == (200, content)
        own = f'attachment; filename="{tmp_path.name}-recording.nc"'
        assert data.headers["content-disposition"] == own
        report = studio.get("/runs/r-1/report.html")
        assert report.body == b"<p>report"
        # Names that others wrote stand in it: it may not speak to the robot in our name.
        rules = report.headers["content-security-policy"].split("; ")
        assert rules[0] == "sandbox allow-scripts allow-downloads"
        assert not [rule for rule in rules if rule.startswith("connect-src")]
        assert studio.get("/runs/r-1/secret.txt").status == 404
        unknown = studio.get("/runs/r-7f3a/report.html")
        assert (unknown.status, unknown.text) == (404, "no recording r-7f3a.")
        absent = studio.get("/runs/r-1/summary.json")
        assert (absent.status, absent.text) == (404, "recording r-1 has no such file.")


@pytest.mark.parametrize("level", [logging.WARNING, logging.DEBUG])
def test_a_mistake_of_ours_is_reported_without_its_detail(tmp_path, caplog, level):
    caplog.set_level(level, "phasmid.studio")
    stage = PretendedStage()
    stage.folder = lambda run: {}[str(tmp_path)]
    with running(stage) as studio:
        answer = studio.get("/runs/r-1/report.html")
        assert answer.status == 500
        assert answer.text == "this is a mistake of phasmid, not yours; please report it."
        assert studio.get("/").status == 200
    [record] = [one for one in caplog.records if one.name == "phasmid.studio"]
    # The traceback is for --debug.
    assert bool(record.exc_info) is (level == logging.DEBUG)
