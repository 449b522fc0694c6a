"""A second process helps to draw, and whatever becomes of it, the pictures are the same."""

import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings

import pytest

from phasmid.errors import InvalidInput
from phasmid.reporting import companion, report
from phasmid.reporting.companion import SWITCH, drawing, helps
from phasmid.reporting.gallery import WALK, Gallery

FEW = tuple((name, "svg") for name in ("fig15", "fig16", "gait-diagram", "power"))


@pytest.fixture
def two_cores(monkeypatch):
    """A machine of which nobody has shared out the cores."""
    if sys.platform != "linux":
        pytest.skip("there is no second process elsewhere")
    monkeypatch.delenv(SWITCH)
    monkeypatch.setattr(companion, "cores", lambda: 2)
    monkeypatch.setattr(companion, "free_cores", lambda: 1.0)
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: None)
    # Those of a pool of tests, which only wait.
    monkeypatch.setattr(threading, "active_count", lambda: 1)


@pytest.fixture
def gallery(short_walk):
    """A few pictures that are quickly drawn."""
    few = Gallery(short_walk)
    few.of_page, few.of_folder = FEW, ()
    return few


@pytest.fixture(scope="module")
def expected(short_walk):
    """What one process draws."""
    return {file: Gallery(short_walk).drawn(file) for file in FEW}


def contents(folder):
    """All files of a folder."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {path.relative_to(folder): path.read_bytes() for path in files}


def left_to(draw):
    """Wait until the second process has taken all pictures, or has ended."""
    second = draw.__self__
    until = time.monotonic() + 60
    while any(second._left) and second._talk.is_alive() and time.monotonic() < until:
        time.sleep(0.01)
    return second


def only_there(monkeypatch, change):
    """Let something else happen when the second process draws, given a picture's name."""
    here, drawn = os.getpid(), Gallery.drawn

    def changed(self, file):
        if os.getpid() != here:
            change(file[0])
        return drawn(self, file)

    monkeypatch.setattr(Gallery, "drawn", changed)


def raising(name):
    raise ValueError(name)


@pytest.mark.usefixtures("two_cores")
def test_pictures_of_the_second_process_are_the_same_to_the_byte(gallery, expected, monkeypatch):
    with drawing(gallery) as draw:
        second = left_to(draw)
        # All come from there: none is drawn here.
        monkeypatch.setattr(Gallery, "drawn", None)
        assert draw(FEW) == expected
    assert not second._process.is_alive()


def test_a_figures_second_file_does_not_depend_on_its_first(short_walk):
    both = Gallery(short_walk)
    assert both.of_folder
    for name, ending in both.of_folder:
        both.drawn((name, "svg"))
        assert both.drawn((name, ending)) == Gallery(short_walk).drawn((name, ending))


@pytest.mark.usefixtures("two_cores")
def test_files_that_come_after_the_page_are_drawn_by_the_second_process_too(
    gallery, expected, monkeypatch
):
    gallery.of_folder = (("fig15", "png"), ("fig16", "png"))
    later = {file: Gallery(gallery.recording).drawn(file) for file in gallery.of_folder}
    with drawing(gallery) as draw:
        left_to(draw)
        with monkeypatch.context() as away:
            away.setattr(Gallery, "drawn", None)
            assert draw(FEW) == expected
            assert draw(gallery.of_folder) == later
    # Or by the first one, where the second is busy or dead.
    with drawing(gallery) as draw:
        draw.__self__._process.kill()
        assert draw(FEW) == expected
        assert draw(gallery.of_folder) == later


@pytest.mark.slow
@pytest.mark.usefixtures("two_cores")
def test_a_folder_is_the_same_to_the_byte_with_and_without_a_second_process(
    short_walk, tmp_path, monkeypatch
):
    came = []
    answer = companion._Companion._answer

    def noted(self):
        came.append(answer(self))
        return came[-1]

    monkeypatch.setattr(companion._Companion, "_answer", noted)
    report(short_walk, tmp_path / "two")
    # The last word, that no more comes, is not waited for.
    assert came
    assert None not in came
    monkeypatch.setenv(SWITCH, "1")
    report(short_walk, tmp_path / "one")
    one, two = (contents(tmp_path / name) for name in ("one", "two"))
    # Five figures of two files each, the robot, the page, and four files of text and numbers.
    assert len(one) == 5 * 2 + 1 + 1 + 4
    assert one == two


@pytest.mark.usefixtures("two_cores")
def test_what_cannot_be_started_is_not_missed(gallery, expected, monkeypatch):
    def none_left(*_):
        raise BlockingIOError

    monkeypatch.setattr(os, "fork", none_left)
    assert helps(gallery)
    with drawing(gallery) as draw:
        assert draw(FEW) == expected


@pytest.mark.usefixtures("two_cores")
@pytest.mark.parametrize(
    "change",
    [
        lambda _: os._exit(3),
        lambda name: os._exit(3) if name == "gait-diagram" else None,
        raising,
    ],
    ids=["at its first picture", "at its second picture", "at none, but none drawn"],
)
def test_a_second_process_that_dies_leaves_its_pictures_to_the_first(
    gallery, expected, monkeypatch, capfd, change
):
    only_there(monkeypatch, change)
    gallery.of_folder = (("fig15", "png"), ("fig16", "png"))
    with drawing(gallery) as draw:
        left_to(draw)
        assert draw(FEW) == expected
        begin = time.monotonic()
        assert len(draw(gallery.of_folder)) == 2
        # That nothing more comes from there is known.
        assert time.monotonic() - begin < companion.PATIENCE / 2
    # It has no last words for the user, who has all pictures.
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("two_cores")
def test_a_second_process_that_hangs_is_given_up(gallery, expected, monkeypatch):
    only_there(monkeypatch, lambda _: time.sleep(1000))
    monkeypatch.setattr(companion, "PATIENCE", 0.5)
    with drawing(gallery) as draw:
        second = draw.__self__
        while len(second._left[0]) == len(FEW):
            time.sleep(0.01)
        assert draw(FEW) == expected
    assert not second._process.is_alive()


@pytest.mark.usefixtures("two_cores")
def test_warnings_of_the_second_process_are_told(gallery, monkeypatch):
    only_there(monkeypatch, lambda name: warnings.warn(f"a word on {name}", stacklevel=1))
    with drawing(gallery) as draw:
        left_to(draw)
        with pytest.warns(UserWarning, match="a word on") as caught:
            draw(FEW)
    words = [f"a word on {name}" for name, _ in sorted(FEW)]
    assert sorted(str(w.message) for w in caught) == words


@pytest.mark.usefixtures("two_cores")
def test_an_error_is_raised_as_if_there_were_one_process(gallery, monkeypatch):
    def fail(self, file):
        raise InvalidInput(f"{file[0]} cannot be drawn.")

    monkeypatch.setattr(Gallery, "drawn", fail)
    with drawing(gallery) as draw:
        left_to(draw)
        with pytest.raises(InvalidInput, match="cannot be drawn"):
            draw(FEW)


@pytest.mark.usefixtures("two_cores")
def test_ctrl_c_ends_both_processes_and_leaves_nothing(short_walk, tmp_path, monkeypatch):
    seconds = []
    start = companion._Companion.__init__

    def started(self, *arguments):
        start(self, *arguments)
        seconds.append(self)

    here = os.getpid()

    def interrupted(self, file):
        if os.getpid() == here:
            signal.raise_signal(signal.SIGINT)
        time.sleep(1000)

    monkeypatch.setattr(companion._Companion, "__init__", started)
    monkeypatch.setattr(Gallery, "drawn", interrupted)
    with pytest.raises(KeyboardInterrupt):
        report(short_walk, tmp_path / "walk")
    assert list(tmp_path.iterdir()) == []
    assert [second._process.is_alive() for second in seconds] == [False]
    assert not seconds[0]._talk.is_alive()


@pytest.mark.usefixtures("two_cores")
def test_ctrl_c_of_a_terminal_which_reaches_both_is_left_to_the_first(
    gallery, expected, monkeypatch
):
    with drawing(gallery) as draw:
        os.kill(draw.__self__._process.pid, signal.SIGINT)
        left_to(draw)
        # All come from there: it lives on.
        with monkeypatch.context() as away:
            away.setattr(Gallery, "drawn", None)
            assert draw(FEW) == expected


@pytest.mark.usefixtures("two_cores")
def test_the_second_process_ends_with_the_first(gallery):
    with drawing(gallery) as draw:
        second = left_to(draw)
        second._talk.join(60)
        # As where the first one is killed.
        second._link.close()
        second._process.join(60)
        assert second._process.exitcode == 0


@pytest.mark.usefixtures("two_cores")
def test_a_second_process_is_started_only_where_it_helps(gallery, expected, monkeypatch):
    assert helps(gallery)
    with monkeypatch.context() as one:
        one.setenv(SWITCH, "1")
        assert not helps(gallery)
    with monkeypatch.context() as one:
        one.setattr(companion, "cores", lambda: 1)
        assert not helps(gallery)
    with monkeypatch.context() as one:
        one.setattr(companion, "free_cores", lambda: 0.4)
        assert not helps(gallery)
    with monkeypatch.context() as one:
        one.setattr(multiprocessing, "parent_process", lambda: "a pool")
        assert not helps(gallery)
    with monkeypatch.context() as one:
        one.setattr(threading, "active_count", lambda: 2)
        assert not helps(gallery)
    with monkeypatch.context() as one:
        one.setattr(sys, "platform", "darwin")
        assert not helps(gallery)
    gallery.of_page = FEW[:3]
    assert not helps(gallery)
    with drawing(gallery) as draw:
        assert draw(FEW[:3]) == {file: expected[file] for file in FEW[:3]}


def test_free_cores_are_those_that_the_load_leaves(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    monkeypatch.setattr(os, "getloadavg", lambda: (1.5, 9.0, 9.0), raising=False)
    assert companion.free_cores() == 4 - 1.5

    def untold():
        raise OSError

    monkeypatch.setattr(os, "getloadavg", untold)
    assert companion.free_cores() == 4
    # As on Windows.
    monkeypatch.delattr(os, "getloadavg")
    assert companion.free_cores() == 4


@pytest.mark.usefixtures("two_cores")
def test_the_picture_that_takes_longest_is_the_first_of_the_second_process(short_walk, monkeypatch):
    monkeypatch.setattr(companion._Companion, "_converse", lambda self: None)
    gallery = Gallery(short_walk)
    assert gallery.of_page == (*((name, "svg") for name in gallery.kinds), WALK)
    with drawing(gallery) as draw:
        assert draw.__self__._last() == WALK
