"""Changes are made ready one at a time, the newest of each kind, with rests between them."""

import threading
import time
from concurrent.futures import Future

import pytest

from phasmid.errors import InvalidInput
from phasmid.studio.builder import Builder
from phasmid.studio.messages import Change

PATIENCE = 60.0


class Bench:
    """A builder whose work takes until it is let go."""

    def __init__(self):
        self.made, self.go = [], threading.Semaphore(0)
        self.builder = Builder(self._make, lambda: None)

    def _make(self, request):
        self.made.append(request.value)
        assert self.go.acquire(timeout=PATIENCE)
        if isinstance(request.value, bool):
            raise InvalidInput("as a test has it.")
        return request.value

    def put(self, kind, value):
        answer = Future()
        self.builder.put(kind, Change(name=kind, value=value), answer)
        return answer

    def take(self):
        """The next result."""
        end = time.monotonic() + PATIENCE
        while (job := self.builder.take()) is None:
            assert time.monotonic() < end
            time.sleep(0.001)
        return job.ready


@pytest.fixture
def bench():
    one = Bench()
    yield one
    for _ in range(10):
        one.go.release()
    one.builder.close(PATIENCE)


def test_of_each_kind_the_newest_is_made_and_the_older_ones_are_told(bench):
    answers = [bench.put("payload", 0.0)]
    assert bench.builder.take() is None
    # One is in work; a hundred of three kinds come meanwhile.
    answers += [
        bench.put(kind, k) for k in range(1, 34) for kind in ("robot", "payload", "terrain")
    ]
    for _ in range(4):
        bench.go.release()
    results = [bench.take().result() for _ in range(4)]
    assert results == [0.0, 33.0, 33.0, 33.0]
    assert len(bench.made) == 4
    refused = [answer for answer in answers if answer.done()]
    assert len(refused) == 96
    assert {answer.exception().what for answer in refused} == {
        f"a newer {kind} replaced this one." for kind in ("robot", "payload", "terrain")
    }


def test_what_a_browser_took_back_is_not_begun(bench):
    bench.put("robot", 1.0)
    assert bench.builder.take() is None
    for kind in ("payload", "terrain", "friction"):
        assert bench.put(kind, 2.0).cancel() is True
    bench.put("gait", 3.0)
    bench.go.release()
    bench.go.release()
    assert [bench.take().result() for _ in range(2)] == [1.0, 3.0]
    assert bench.made == [1.0, 3.0]


def test_it_rests_as_long_as_the_last_one_took(bench):
    bench.put("robot", 1.0)
    assert bench.builder.take() is None
    begin = time.monotonic()
    time.sleep(0.2)
    bench.go.release()
    bench.take()
    took = time.monotonic() - begin
    bench.put("robot", 2.0)
    bench.go.release()
    bench.take()
    # Half of the time, at most, belongs to changes.
    assert time.monotonic() - begin >= 2 * took - 0.01


def test_a_refusal_is_kept_for_its_browser(bench):
    bench.put("robot", True)
    bench.go.release()
    with pytest.raises(InvalidInput, match="as a test has it"):
        bench.take().result()


def test_at_its_end_all_are_refused(bench):
    answers = [bench.put(kind, 1.0) for kind in ("robot", "payload")]
    assert bench.builder.take() is None
    bench.go.release()
    bench.builder.close(PATIENCE)
    assert [answer.exception().what for answer in answers] == 2 * ["the studio is closed."]


def test_a_kind_that_is_renewed_often_waits_no_longer(bench):
    """Kinds are made in the order in which they began to wait, whatever replaces them."""
    bench.put("robot", 0)
    assert bench.builder.take() is None
    bench.put("payload", 1)
    bench.put("terrain", 2)
    bench.put("payload", 3)
    for _ in range(3):
        bench.go.release()
        bench.take()
    assert bench.made == [0, 3, 2]


def test_a_request_that_was_taken_back_does_not_replace_that_of_another(bench):
    bench.put("robot", 0)
    assert bench.builder.take() is None
    bench.put("payload", 1)
    withdrawn = Future()
    withdrawn.cancel()
    bench.builder.put("payload", Change(name="payload", value=2), withdrawn)
    for _ in range(2):
        bench.go.release()
        bench.take()
    assert bench.made == [0, 1]
