"""Who is let in by the live page's server: attacks from raw sockets, W1 to W5 and W8."""

import logging
import socket
import sys
import threading
import time
from contextlib import ExitStack

import pytest
from websockets.exceptions import InvalidStatus

from phasmid.studio.server import MOST_CONNECTIONS, listen
from studio.pretended import TOKEN, Answer, PretendedStage, everything, running


@pytest.fixture(scope="module")
def studio():
    with running() as one:
        yield one


@pytest.fixture
def told(caplog):
    caplog.set_level(logging.WARNING, "phasmid.studio")
    return caplog


def test_nothing_listens_beyond_this_machine(studio):
    # The socket's own word; 0.0.0.0 would be every address of the machine.
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
    assert not [name for name in page.headers if name.startswith("access-control")]
    assert "server" not in page.headers


def test_the_head_of_a_page_is_that_of_its_page(studio):
    page, head = studio.get("/"), studio.get("/", method="HEAD")
    assert (head.status, head.body) == (200, b"")
    told = [{k: v for k, v in answer.headers.items() if k != "date"} for answer in (page, head)]
    assert told[0] == told[1]


def test_the_address_with_the_token_lets_a_browser_in(studio):
    first = studio.get(f"/?token={TOKEN}", cookie="")
    assert (first.status, first.headers["location"]) == (303, "/")
    cookie, *rules = first.headers["set-cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} == set(rules)
    assert studio.get("/", cookie=cookie).status == 200
    # Cookies know no ports: another studio on this machine has its own.
    assert cookie.startswith(f"phasmid-{studio.port}=")
    assert studio.server.address == f"http://127.0.0.1:{studio.port}/?token={TOKEN}"


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "", "https://{host}", "{host}"])
def test_w1_a_websocket_of_another_page_is_refused_with_one_line(studio, told, origin):
    given = origin.format(host=studio.host)
    with pytest.raises(InvalidStatus) as refused, studio.open(origin=given):
        pass
    assert refused.value.response.status_code == 403
    assert refused.value.response.body == b"forbidden.\n"
    assert len(told.records) == 1
    assert "\n" not in told.records[0].getMessage()


def test_w1_an_origin_that_drives_a_terminal_does_not_reach_it(studio, told):
    # Bytes above 127 are let through by HTTP; 0x9b begins a terminal's command.
    assert studio.get("/live", Origin="http://\x9b31m.example").status == 403
    assert "\x9b" not in told.text
    assert "�" in told.text


def test_w1_a_page_of_another_port_is_another_page(studio):
    origin = f"http://127.0.0.1:{studio.port + 1}"
    assert studio.get("/live", Origin=origin, Upgrade="websocket").status == 403
    assert studio.get("/", Origin=origin).status == 403


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "127.0.0.1",
        "127.0.0.1:",
        "127.0.0.1:1",
        "127.0.0.1:0{port}",
        "127.0.0.1.:{port}",
        "127.0.0.1:{port}.evil.example",
        "127.0.0.1:{port}@evil.example",
        "evil.example@127.0.0.1:{port}",
        "http://127.0.0.1:{port}",
        "localhost.:{port}",
        "localhost:{port},evil.example",
        "[::1]:{port}",
        "[::ffff:127.0.0.1]:{port}",
        "0.0.0.0:{port}",
        "2130706433:{port}",
        "127.1:{port}",
    ],
)
def test_w2_another_host_is_refused(studio, told, host):
    answer = studio.get("/", host=host.format(port=studio.port))
    assert (answer.status, answer.text) == (403, "forbidden.")
    assert len(told.records) == 1


def test_w2_a_host_must_be_told_once(studio):
    line = f"Host: {studio.host}\r\n"
    for lines in ("", 2 * line, f"{line}Host: evil.example\r\n"):
        request = f"GET / HTTP/1.1\r\n{lines}Cookie: {studio.cookie}\r\n\r\n"
        assert Answer(studio.raw(request.encode())).status == 403


def test_w2_the_machine_may_be_called_localhost(studio):
    assert studio.get("/", host=f"localhost:{studio.port}").status == 200


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has all of 127.0.0.0/8")
def test_w2_the_machine_may_be_called_by_the_address_at_which_a_request_arrives():
    with running(listening=listen("0.0.0.0", 0), host="0.0.0.0") as wide:
        for host, status in (
            ("127.0.0.2", 200),
            ("localhost", 200),
            ("127.0.0.3", 403),
            ("0.0.0.0", 403),
            ("127.0.0.2.evil.example", 403),
        ):
            told = f"Host: {host}:{wide.port}\r\nCookie: {wide.cookie}"
            raw = f"GET / HTTP/1.1\r\n{told}\r\n\r\n".encode()
            assert Answer(wide.raw(raw, to="127.0.0.2")).status == status, host


@pytest.mark.parametrize(
    "cookie", ["", "x=y", "phasmid-{port}=", "phasmid-{port}=wrong", "phasmid-1={token}", "{token}"]
)
@pytest.mark.parametrize("path", ["/", "/assets/studio.js", "/runs/r-7f3a/report.html", "/live"])
def test_w3_without_the_token_there_is_nothing(studio, path, cookie):
    answer = studio.get(
        path,
        cookie=cookie.format(port=studio.port, token=TOKEN) or "a=b",
        Origin=studio.origin,
        Upgrade="websocket",
    )
    assert answer.status == 401
    assert answer.text == "open the address that phasmid studio printed: it carries the token."


@pytest.mark.parametrize("query", ["token=", "token=wrong", f"token={TOKEN}&x=1", "x=1", "token"])
def test_w3_a_wrong_token_opens_nothing(studio, query):
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
        "/assets/..\\..\\windows",
        "/assets/%252e%252e%252fetc%252fpasswd",
        "/assets/studio.js%00.png",
        "/assets/studio.js/",
        "/assets/./studio.js",
        "/assets//studio.js",
        "/assets/",
        "/assets",
        "//etc/passwd",
        "/etc/passwd",
        "etc/passwd",
        "http://127.0.0.1/",
        "*",
        "/Studio.html",
        "/studio.html",
        "/assets/studio.html",
        "/runs/",
        "/runs/../report.html",
        "/runs/r-7f3a/../../x",
        "/runs/r-7f3a/%2e%2e",
        "/runs/r-7f3a/..",
        "/runs/r-7f3a//report.html",
        "/runs/R-7F3A/report.html",
        "/runs/r-7f3a/recording.nc/",
        "/assets/studio.js?x=1",
        "/" + 9000 * "a",
    ],
)
def test_w4_only_what_stands_in_the_table_is_found(studio, path):
    assert studio.get(path).status == 404


def test_w4_a_path_with_what_no_path_has_is_no_http(studio):
    for path in (b"/\x00", b"/a b", b"/\xc3\xa4", b"", b"/\x7f", b"/a\tb"):
        request = b"GET " + path + b" HTTP/1.1\r\nHost: " + studio.host.encode() + b"\r\n\r\n"
        assert Answer(studio.raw(request)).status == 400


def test_w5_a_body_of_eleven_megabytes_is_refused_while_it_is_sent(studio):
    body = bytes(11_000_000)
    head = f"POST / HTTP/1.1\r\nHost: {studio.host}\r\nContent-Length: {len(body)}\r\n\r\n"
    answer = Answer(studio.raw(head.encode() + body))
    assert (answer.status, answer.text) == (413, "request is 11 MB; the limit is 10 MB.")


@pytest.mark.parametrize(
    ("method", "headers", "status"),
    [
        ("POST", {}, 405),
        ("PUT", {"Content-Length": "3"}, 405),
        ("OPTIONS", {}, 405),
        ("TRACE", {}, 405),
        ("CONNECT", {}, 405),
        ("get", {}, 405),
        ("GET", {"Content-Length": "3"}, 400),
        ("GET", {"Content-Length": "-1"}, 400),
        ("GET", {"Content-Length": "1e3"}, 400),
        ("GET", {"Content-Length": "9" * 40}, 400),
        ("GET", {"Transfer-Encoding": "chunked"}, 400),
        ("POST", {"Transfer-Encoding": "chunked"}, 405),
    ],
)
def test_what_would_bring_a_body_is_refused(studio, method, headers, status):
    answer = studio.get("/", method=method, **headers)
    assert answer.status == status
    assert ("allow" in answer.headers) == (status == 405)


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"GET / HTTP/1.0\r\nHost: x\r\n\r\n", 505),
        (b"GET / HTTP/2\r\nHost: x\r\n\r\n", 505),
        (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505),
        (b"GET /\r\n\r\n", 400),
        (b"\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost : x\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: x\r\n folded\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: x\nEvil: y\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: x\rEvil: y\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: \x00\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\n: x\r\n\r\n", 400),
        (b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\n" + 101 * b"A: b\r\n" + b"\r\n", 431),
        (b"GET / HTTP/1.1\r\nA: " + 20_000 * b"b" + b"\r\n\r\n", 431),
        (b"GET / HTTP/1.1\r\nA: " + 20_000 * b"b", 431),
        (b"G" * 20_000, 431),
    ],
)
def test_what_is_no_request_of_today_is_refused(studio, request_, status):
    answer = Answer(studio.raw(request_))
    assert answer.status == status
    assert answer.text.endswith(".")


def test_w8_an_unknown_recording_is_named(studio):
    answer = studio.get("/runs/r-7f3a/report.html")
    assert (answer.status, answer.text) == (404, "no recording r-7f3a.")


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
        assert studio.get("/runs/r-1/recording.nc", method="HEAD").body == b""
        report = studio.get("/runs/r-1/report.html")
        assert report.body == b"<p>report"
        # Names that others wrote stand in it: it may not speak to the robot in our name.
        rules = report.headers["content-security-policy"].split("; ")
        assert rules[0] == "sandbox allow-scripts allow-downloads"
        assert not [rule for rule in rules if rule.startswith("connect-src")]
        assert studio.get("/runs/r-1/secret.txt").status == 404
        absent = studio.get("/runs/r-1/summary.json")
        assert (absent.status, absent.text) == (404, "recording r-1 has no such file.")


def test_a_mistake_of_ours_is_told_without_its_detail(tmp_path, told):
    stage = PretendedStage()
    stage.folder = lambda run: {}[str(tmp_path)]
    with running(stage) as studio:
        answer = studio.get("/runs/r-1/report.html")
        assert answer.status == 500
        said = "this is a mistake of phasmid, not yours; please report it."
        assert answer.text == said
        assert studio.get("/").status == 200
    assert [record.exc_info for record in told.records] == [None]


def test_a_mistake_of_ours_is_traced_where_that_is_asked(caplog):
    caplog.set_level(logging.DEBUG, "phasmid.studio")
    stage = PretendedStage()
    stage.folder = lambda run: {}[run]
    with running(stage) as studio:
        assert studio.get("/runs/r-1/report.html").status == 500
    assert "Traceback" in caplog.text


def test_what_comes_after_a_request_is_not_read_as_another(studio):
    one = f"GET / HTTP/1.1\r\nHost: {studio.host}\r\nCookie: {studio.cookie}\r\n\r\n".encode()
    assert studio.raw(one + one).count(b"HTTP/1.1 200") == 1


def test_who_speaks_slowly_is_sent_away(monkeypatch):
    monkeypatch.setattr("phasmid.studio.door.PATIENCE", 0.2)
    with running() as studio:
        with socket.create_connection(("127.0.0.1", studio.port), 20) as slow:
            slow.sendall(b"GET / HTTP/1.1\r\nA: ")
            answer = Answer(everything(slow))
        assert (answer.status, answer.text) == (408, "the request took too long.")
        with socket.create_connection(("127.0.0.1", studio.port), 20) as silent:
            assert Answer(everything(silent)).status == 408


def keep_sending(end):
    for _ in range(2000):
        end.sendall(b"x")
        time.sleep(0.01)


def test_who_has_been_answered_and_stays_is_sent_away(monkeypatch):
    monkeypatch.setattr("phasmid.studio.door.FAREWELL", 0.2)
    with running() as studio, socket.create_connection(("127.0.0.1", studio.port), 20) as end:
        end.sendall(b"x\r\n\r\n")
        assert Answer(everything(end)).status == 400
        # Once the other side has closed wholly, what is written to it comes back as a refusal.
        with pytest.raises(ConnectionError):
            keep_sending(end)


def test_who_speaks_byte_by_byte_is_understood(studio):
    request = f"GET / HTTP/1.1\r\nHost: {studio.host}\r\nCookie: {studio.cookie}\r\n\r\n".encode()
    with socket.create_connection(("127.0.0.1", studio.port), 20) as end:
        for i in range(len(request)):
            end.sendall(request[i : i + 1])
        assert Answer(everything(end)).status == 200


def test_who_closes_half_of_the_connection_is_answered(studio):
    request = f"GET / HTTP/1.1\r\nHost: {studio.host}\r\nCookie: {studio.cookie}\r\n\r\n".encode()
    with socket.create_connection(("127.0.0.1", studio.port), 20) as end:
        end.sendall(request)
        end.shutdown(socket.SHUT_WR)
        assert Answer(everything(end)).status == 200


def test_too_many_connections_are_sent_away_and_the_page_stays(monkeypatch):
    monkeypatch.setattr("phasmid.studio.server.MOST_CONNECTIONS", 2)
    with running() as studio:
        with studio.connect(), studio.connect():
            answer = studio.get("/")
            assert (answer.status, answer.text) == (503, "too many connections; close some pages.")
        # A closed connection is forgotten as soon as the server has read its end.
        while (answer := studio.get("/")).status == 503:
            pass
        assert answer.status == 200


@pytest.mark.parametrize("said", [b"", b"x\r\n\r\n"], ids=["silent", "answered"])
def test_connections_that_wait_for_nothing_keep_nobody_out(monkeypatch, said):
    # None of them runs into its time limit: the oldest are closed for the request that comes.
    for limit in ("PATIENCE", "FAREWELL"):
        monkeypatch.setattr(f"phasmid.studio.door.{limit}", 600.0)
    with running() as studio, ExitStack() as ends:
        for _ in range(MOST_CONNECTIONS):
            end = ends.enter_context(socket.create_connection(("127.0.0.1", studio.port), 20))
            end.sendall(said)
            if said:
                assert Answer(everything(end)).status == 400
        assert studio.get("/").status == 200


def test_many_at_once_are_all_answered(studio):
    answers = []

    def ask():
        answers.append(studio.get("/assets/studio.js").status)

    asking = [threading.Thread(target=ask) for _ in range(40)]
    for one in asking:
        one.start()
    for one in asking:
        one.join(20)
    assert answers == 40 * [200]
