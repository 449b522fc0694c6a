"""Messages between browsers and the live robot, and their limits, on real sockets."""

import asyncio
import base64
import errno
import json
import logging
import socket
import struct
import time
from concurrent.futures import Future
from contextlib import ExitStack, suppress

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from phasmid.errors import InvalidInput
from phasmid.studio.browser import MOST_WAITING, RATE
from phasmid.studio.connection import MOST_CONNECTIONS, report_loop_error
from phasmid.studio.messages import Play
from phasmid.studio.server import MOST_BROWSERS, listen
from studio.pretended import PretendedStage, reply, running, say


@pytest.fixture
def studio():
    with running() as one:
        yield one


def test_a_browser_is_greeted_and_brought_up_to_date(studio):
    with studio.open() as page:
        first = json.loads(page.recv(timeout=20))["hello"]
        assert first["version"]
        assert [page.recv(timeout=20) for _ in range(2)] == studio.stage.hello()


def test_a_request_reaches_the_robot_and_its_answer_the_browser(studio):
    studio.stage.answer = {"text": "<script>"}
    with studio.connect() as page:
        told = say(page, id=7, do="play", how="pause")
        assert told == {"reply": 7, "status": 200, "answer": {"text": "<script>"}}
    assert studio.stage.asked.get(timeout=20) == Play(how="pause", id=7)


def test_what_is_impossible_is_told_as_the_command_line_tells_it(studio):
    studio.stage.answer = InvalidInput('no gait called "tripode".', hint='"tripod"')
    with studio.connect() as page:
        told = say(page, id=1, do="change", name="gait", value="tripode")
        said = {"text": 'no gait called "tripode".', "hint": '"tripod"'}
        assert told == {"reply": 1, "status": 422} | said


@pytest.mark.parametrize("answer", [KeyError("secret"), {"x": object()}, {"x": float("nan")}])
def test_a_mistake_of_ours_is_told_without_its_detail_and_ends_nothing(answer, caplog):
    caplog.set_level(logging.WARNING, "phasmid.studio")
    with running(PretendedStage(answer=answer)) as studio, studio.connect() as page:
        told = say(page, id=1, do="play", how="play")
        assert told["status"] == 500
        assert told["text"] == "this is a mistake of phasmid, not yours; please report it."
        studio.stage.answer = None
        assert say(page, id=2, do="play", how="play")["status"] == 200
    assert len(caplog.records) == 1
    assert caplog.records[0].exc_info is None


def test_a_message_of_eleven_megabytes_is_refused_in_a_sentence(studio):
    content = base64.b64encode(bytes(8_250_000)).decode()
    with studio.connect() as page:
        told = say(page, id=1, do="load", what="terrain", name="a.png", content=content)
        assert told["status"] == 413
        assert told["text"] == "message is 11.0 MB; the limit is 10 MB."
        assert say(page, id=2, do="play", how="play")["status"] == 200


FRAMES = {
    # Opcode, length and mask of RFC 6455, section 5.2, by hand.
    "13 MB": b"\x81\xff" + struct.pack("!Q", 13_000_000) + bytes(4 + 65536),
    "unmasked": b"\x81\x02{}",
    "reserved bits": b"\xf1\x82" + bytes(6),
    "reserved opcode": b"\x83\x82" + bytes(6),
    "long control frame": b"\x89\xfe\x00\xff" + bytes(4 + 255),
    "part of nothing": b"\x80\x82" + bytes(6),
    "no UTF-8": b"\x81\x82\x00\x00\x00\x00\xff\xff",
    "half a close code": b"\x88\x81" + bytes(5),
    "wrong close code": b"\x88\x82\x00\x00\x00\x00\x00\x01",
    "a frame, then none": b"\x81\x82\x00\x00\x00\x00{}" + b"\xff" * 40,
}


@pytest.mark.parametrize("frame", FRAMES.values(), ids=FRAMES)
def test_what_is_no_frame_ends_its_connection_without_a_word_of_ours(frame, studio, caplog):
    caplog.set_level(logging.DEBUG, "phasmid.studio")
    with handshake(studio) as end, studio.connect() as other:
        end.sendall(frame)
        # Texts and frames go on while the connection closes.
        for number in range(50):
            studio.server.publish(json.dumps({"event": number}))
            studio.server.publish(bytes(1000))
        with suppress(ConnectionResetError):
            while end.recv(65536):
                pass
        assert say(other, id=1, do="play", how="play")["status"] == 200
    assert not caplog.records


def test_what_a_browser_asked_for_is_dropped_when_it_leaves(studio):
    studio.stage.answer = Future()
    with studio.connect() as page:
        page.send('{"do": "change", "name": "terrain", "value": "stairs"}')
        studio.stage.asked.get(timeout=20)
    assert [studio.stage.looking.get(timeout=20) for _ in range(2)] == [1, 0]
    # The simulation asks this before it carries a request out.
    assert studio.stage.answer.set_running_or_notify_cancel() is False


def test_what_is_no_request_is_refused_and_the_page_stays(studio):
    with studio.connect() as page:
        for text in ("hello", '{"id": NaN}', 5000 * "[", b"bytes", ""):
            page.send(text)
            assert (reply(page)["status"]) == 422
        told = say(page, id=3, do="pace", factor="fast")
        assert (told["reply"], told["text"]) == (
            3,
            'factor is "fast"; it must be a number 0.05 or more and 10 or less.',
        )
        assert say(page, id=4, do="play", how="play")["status"] == 200
    assert studio.stage.asked.qsize() == 1


def test_a_ninth_browser_is_refused_until_one_leaves(studio):
    pages = [studio.connect() for _ in range(MOST_BROWSERS)]
    for page in pages:
        page.__enter__()
    with pytest.raises(InvalidStatus) as refused, studio.open():
        pass
    assert refused.value.response.status_code == 429
    assert refused.value.response.body == b"8 browsers look already; close one of them.\n"
    for page in pages:
        page.__exit__(None, None, None)
    counts = [studio.stage.looking.get(timeout=20) for _ in range(2 * MOST_BROWSERS)]
    assert counts == [1, 2, 3, 4, 5, 6, 7, 8, 7, 6, 5, 4, 3, 2, 1, 0]
    with studio.connect() as page:
        assert say(page, id=1, do="play", how="play")["status"] == 200


def test_a_browser_waits_for_its_answers(studio):
    studio.stage.answer = Future()
    with studio.connect() as page:
        for _ in range(MOST_WAITING):
            page.send('{"do": "stick", "at": [0, 0, 0]}')
        told = say(page, id=1, do="play", how="play")
        assert told["status"] == 429
        assert told["text"] == "100 commands wait for their answers; wait for them."
        studio.stage.answer.set_result({})
        studio.stage.answer = None
    assert studio.stage.asked.qsize() == MOST_WAITING


def test_ten_thousand_commands_are_mostly_refused_and_others_are_served(studio, monkeypatch):
    # What waits on its way is read in a fifth of the time, as this is a test.
    monkeypatch.setattr("phasmid.studio.browser.PAUSE", 0.01)
    with studio.connect() as flood, studio.connect() as other:
        begin = time.monotonic()
        for _ in range(10_000):
            flood.send('{"do": "stick", "at": [1, 0, 0]}')
        assert say(other, id=1, do="play", how="play")["status"] == 200
        told = reply(flood)
        assert told["status"] == 429
        assert told["text"] == "more than 200 commands a second; the others are left out."
        # After a while it may ask again, however much it had asked.
        heard = False
        while not heard:
            flood.send('{"id": 2, "do": "pace", "factor": 1}')
            with suppress(TimeoutError):
                heard = json.loads(flood.recv(timeout=0.5))["reply"] == 2
        taken = studio.stage.asked.qsize()
        passed = time.monotonic() - begin
    # As many at once as may come in a second, then as many a second.
    assert RATE <= taken <= RATE * (1 + passed) + 2


def test_a_slow_reader_gets_the_newest_frame_and_no_backlog(studio):
    # Nothing on the way holds 200 MB.
    frames = [struct.pack("<i", i) + bytes(100_000) for i in range(2000)]
    with studio.connect(max_queue=1) as slow, studio.connect() as quick:
        for frame in frames:
            studio.server.publish(frame)
        studio.server.publish('{"event": "last"}')
        seen = {}
        for name, page in (("quick", quick), ("slow", slow)):
            messages = iter(lambda page=page: page.recv(timeout=20), '{"event": "last"}')
            seen[name] = [struct.unpack("<i", message[:4])[0] for message in messages]
            # The texts come first, as none of them may be lost.
            rest = page.recv(timeout=20) if seen[name][-1:] != [1999] else b""
            seen[name] += [struct.unpack("<i", rest[:4])[0]] if rest else []
    for numbers in seen.values():
        assert numbers == sorted(set(numbers))
        assert numbers[-1] == 1999
    assert len(seen["slow"]) < len(frames)


def test_who_reads_nothing_is_given_up(monkeypatch, studio):
    monkeypatch.setattr("phasmid.studio.browser.PATIENCE", 0.5)
    # What the system keeps for it on the way is little.
    end = socket.socket()
    end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    end.connect(("127.0.0.1", studio.port))
    with studio.connect(max_queue=1, sock=end) as slow, studio.connect() as other:
        assert [studio.stage.looking.get(timeout=20) for _ in range(2)] == [1, 2]
        # The other keeps up: it is told more only when it has read the last.
        for _ in range(12):
            studio.server.publish(json.dumps({"event": 500_000 * "x"}))
            other.recv(timeout=20)
        assert studio.stage.looking.get(timeout=20) == 1
        with pytest.raises(ConnectionClosed):
            reply(slow)
        assert say(other, id=1, do="play", how="play")["status"] == 200


def handshake(studio):
    """A websocket by hand: a browser whose machine can vanish."""
    end = socket.create_connection(("127.0.0.1", studio.port), 20)
    lines = [
        "GET /live HTTP/1.1",
        f"Host: {studio.host}",
        f"Origin: {studio.origin}",
        f"Cookie: {studio.cookie}",
        "Connection: Upgrade",
        "Upgrade: websocket",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==",
    ]
    end.sendall("\r\n".join([*lines, "", ""]).encode())
    assert end.recv(65536).startswith(b"HTTP/1.1 101 ")
    return end


def test_a_browser_that_vanishes_from_the_network_is_missed(monkeypatch):
    monkeypatch.setattr("phasmid.studio.server.PING", 0.1)
    monkeypatch.setattr("phasmid.studio.server.PONG", 0.2)
    with running() as studio, handshake(studio) as end:
        assert studio.stage.looking.get(timeout=20) == 1
        # Nobody answers to its pings, though the connection stands.
        assert studio.stage.looking.get(timeout=20) == 0
        while end.recv(65536):
            pass


HEAD = "GET / HTTP/1.1\r\nHost: {}\r\n"


@pytest.mark.parametrize(
    "sent",
    [
        "",
        HEAD,
        HEAD + "\r\n",
        HEAD + "\r\n" + HEAD,
        "POST" + HEAD[3:] + "Content-Length: 9\r\n\r\nx",
    ],
)
def test_a_connection_without_a_whole_request_ends(sent, monkeypatch):
    monkeypatch.setattr("phasmid.studio.connection.LONGEST_HEAD", 0.1)
    # uvicorn's own limit, of the time without a byte, plays no part.
    with running() as studio, studio.connect() as page:
        studio.server._server.config.timeout_keep_alive = 600
        with socket.create_connection(("127.0.0.1", studio.port), 20) as end:
            end.sendall(sent.format(studio.host, studio.host).encode())
            with suppress(ConnectionResetError):
                while end.recv(65536):
                    pass
        # Websockets have limits of their own, and a request begins anew.
        time.sleep(0.2)
        assert say(page, id=1, do="play", how="play")["status"] == 200
        assert studio.get("/").status == 200


def test_silent_connections_leave_the_page_in_reach(studio, caplog):
    with ExitStack() as ends, studio.connect() as page:
        for _ in range(MOST_CONNECTIONS + 20):
            ends.enter_context(socket.create_connection(("127.0.0.1", studio.port), 20))
        assert studio.get("/").status == 200
        # Those that ended are counted out with the next turn of the loop.
        assert studio.get("/").status == 200
        assert len(studio.server._server.server_state.connections) <= MOST_CONNECTIONS
        assert say(page, id=1, do="play", how="play")["status"] == 200
    assert not caplog.records


def test_errors_of_the_system_are_no_mistakes_of_ours(caplog):
    loop = asyncio.new_event_loop()
    loop.set_exception_handler(report_loop_error)
    for error in (OSError(errno.EMFILE, "Too many open files"), ConnectionResetError()):
        loop.call_exception_handler({"message": "socket.accept() out of", "exception": error})
    assert not caplog.records
    loop.call_exception_handler({"message": "x", "exception": KeyError("x")})
    assert len(caplog.records) == 1
    loop.close()


def test_the_end_of_the_studio_is_told_and_frees_its_port():
    with running() as studio, studio.connect() as page, handshake(studio):
        idle = socket.create_connection(("127.0.0.1", studio.port), 20)
        studio.server.stop()
        with pytest.raises(ConnectionClosed) as closed:
            page.recv(timeout=20)
        assert closed.value.rcvd.code == 1012
        idle.close()
    # Nothing is published to a loop that has ended, and nothing breaks.
    studio.server.publish("{}")
    with listen("127.0.0.1", studio.port) as again:
        assert again.getsockname() == studio.bound
