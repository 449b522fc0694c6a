"""A second process helps to draw, and whatever becomes of it, the pictures are the same."""

import multiprocessing
import os
import signal
import sys
import time

import pytest

from phasmid.errors import InvalidInput
from phasmid.reporting import companion, report
from phasmid.reporting.companion import SWITCH, drawing, helps, standby
from phasmid.reporting.gallery import WALK, Gallery

FEW = ("fig15", "fig16", "gait-diagram", "power")


@pytest.fixture
def two_cores(monkeypatch):
    """A machine of which nobody has shared out the cores."""
    monkeypatch.delenv(SWITCH)
    monkeypatch.setattr(companion, "cores", lambda: 2)
    monkeypatch.setattr(companion, "free_cores", lambda: 1.0)
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: None)


@pytest.fixture
def gallery(short_walk):
    """A few pictures that are quickly drawn."""
    few = Gallery(short_walk)
    few.names = FEW
    return few


@pytest.fixture(scope="module")
def expected(short_walk):
    """What one process draws."""
    return {name: Gallery(short_walk).drawn(name) for name in FEW}


def contents(folder):
    """All files of a folder."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {path.relative_to(folder): path.read_bytes() for path in files}


def left_to(draw):
    """Wait until the second process has taken all pictures, or has ended."""
    second = draw.__self__
    until = time.monotonic() + 60
    while second._left and second._talk.is_alive() and time.monotonic() < until:
        time.sleep(0.01)
    return second


def changed_start(lines):
    """A second process in which something else happens when it draws."""
    return f"""
import os, sys, warnings
from phasmid.reporting import companion, gallery
drawn = gallery.Gallery.drawn
def changed(self, name):
    {lines}
    return drawn(self, name)
gallery.Gallery.drawn = changed
companion.serve()
"""


@pytest.mark.usefixtures("two_cores")
def test_pictures_of_the_second_process_are_the_same_to_the_byte(gallery, expected, monkeypatch):
    with drawing(gallery) as draw:
        second = left_to(draw)
        # All come from there: none is drawn here.
        monkeypatch.setattr(Gallery, "drawn", None)
        assert draw() == expected
    assert second._process.program.poll() is not None


@pytest.mark.slow
@pytest.mark.usefixtures("two_cores")
def test_a_folder_is_the_same_to_the_byte_with_and_without_a_second_process(
    short_walk, tmp_path, monkeypatch
):
    talks = []
    begin = companion._Companion._converse

    def converse(self, order):
        begin(self, order)
        talks.append(self._well)

    monkeypatch.setattr(companion._Companion, "_converse", converse)
    report(short_walk, tmp_path / "two")
    assert talks == [True]
    monkeypatch.setenv(SWITCH, "1")
    report(short_walk, tmp_path / "one")
    assert talks == [True]
    one, two = (contents(tmp_path / name) for name in ("one", "two"))
    # Five figures of two files each, the robot, the page, and four files of text and numbers.
    assert len(one) == 5 * 2 + 1 + 1 + 4
    assert one == two


@pytest.mark.usefixtures("two_cores")
def test_what_cannot_be_started_is_not_missed(gallery, expected, monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python3"))
    assert helps(gallery)
    with drawing(gallery) as draw:
        assert draw() == expected


@pytest.mark.usefixtures("two_cores")
@pytest.mark.parametrize(
    "start",
    [
        "raise SystemExit('no phasmid here')",
        changed_start("os._exit(3)"),
        changed_start("name == 'gait-diagram' and os._exit(3)"),
        changed_start("raise ValueError(name)"),
    ],
    ids=["at once", "at its first picture", "at its second picture", "at none, but none drawn"],
)
def test_a_second_process_that_dies_leaves_its_pictures_to_the_first(
    gallery, expected, monkeypatch, capfd, start
):
    monkeypatch.setattr(companion, "START", start)
    with drawing(gallery) as draw:
        left_to(draw)
        assert draw() == expected
    # Its last words are no concern of the user, who has all pictures.
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("two_cores")
@pytest.mark.skipif(sys.platform == "win32", reason="processes cannot be stopped there")
def test_a_second_process_that_hangs_is_given_up(gallery, expected, monkeypatch):
    monkeypatch.setattr(companion, "START", changed_start("import time; time.sleep(1000)"))
    monkeypatch.setattr(companion, "PATIENCE", 0.5)
    with drawing(gallery) as draw:
        second = draw.__self__
        while len(second._left) == len(FEW):
            time.sleep(0.01)
        assert draw() == expected
    assert second._process.program.poll() is not None


@pytest.mark.usefixtures("two_cores")
def test_warnings_and_words_of_the_second_process_are_told(gallery, monkeypatch, capfd):
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    lines = "warnings.warn(f'a word on {name}'); print('by the way')"
    monkeypatch.setattr(companion, "START", changed_start(lines))
    with drawing(gallery) as draw:
        left_to(draw)
        with pytest.warns(UserWarning, match="a word on") as caught:
            draw()
    assert sorted(str(w.message) for w in caught) == [f"a word on {name}" for name in sorted(FEW)]
    # What is printed there stands in nobody's way.
    assert capfd.readouterr().err == "by the way\n" * len(FEW)


@pytest.mark.usefixtures("two_cores")
def test_an_error_is_raised_as_if_there_were_one_process(gallery, monkeypatch):
    def fail(self, name):
        raise InvalidInput(f"{name} cannot be drawn.")

    monkeypatch.setattr(companion, "START", changed_start("raise ValueError(name)"))
    monkeypatch.setattr(Gallery, "drawn", fail)
    with drawing(gallery) as draw:
        left_to(draw)
        with pytest.raises(InvalidInput, match="cannot be drawn"):
            draw()


@pytest.mark.usefixtures("two_cores")
def test_ctrl_c_ends_both_processes_and_leaves_nothing(short_walk, tmp_path, monkeypatch):
    seconds = []
    start = companion._Companion.__init__

    def started(self, *arguments):
        start(self, *arguments)
        seconds.append(self)

    def interrupted(self, name):
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(companion._Companion, "__init__", started)
    monkeypatch.setattr(Gallery, "drawn", interrupted)
    with pytest.raises(KeyboardInterrupt):
        report(short_walk, tmp_path / "walk")
    assert list(tmp_path.iterdir()) == []
    assert [second._process.program.poll() is None for second in seconds] == [False]
    assert not seconds[0]._talk.is_alive()


@pytest.mark.usefixtures("two_cores")
@pytest.mark.skipif(sys.platform == "win32", reason="a signal to one process ends it there")
def test_ctrl_c_of_a_terminal_which_reaches_both_is_left_to_the_first(gallery, expected):
    with drawing(gallery) as draw:
        second = draw.__self__
        # It has said that it is ready as soon as it takes a picture.
        while len(second._left) == len(FEW):
            time.sleep(0.01)
        second._process.program.send_signal(signal.SIGINT)
        second = left_to(draw)
        assert draw() == expected
        assert second._well


@pytest.mark.usefixtures("two_cores")
def test_the_second_process_ends_with_the_first(gallery):
    with drawing(gallery) as draw:
        second = left_to(draw)
        second._talk.join(60)
        # As where the first one is killed.
        second._process.orders.close()
        assert second._process.program.wait(60) == 0


@pytest.mark.usefixtures("two_cores")
def test_a_process_on_standby_is_the_one_that_draws(gallery, expected, monkeypatch):
    with standby():
        (ready,) = companion._ready
        # It is wanted even where none would be started now.
        monkeypatch.setattr(companion, "free_cores", lambda: 0.0)
        with drawing(gallery) as draw:
            second = left_to(draw)
            assert second._process is ready
            assert draw() == expected
            assert second._well
        assert ready.program.poll() is not None
        # It helps once.
        assert not helps(gallery)


@pytest.mark.usefixtures("two_cores")
def test_a_process_on_standby_that_nobody_needs_ends(gallery, expected):
    with standby():
        (ready,) = companion._ready
    assert ready.program.poll() is not None
    assert companion._ready == []
    with standby():
        # Who dies before there is anything to draw is not missed.
        companion._ready[0].kill()
        with drawing(gallery) as draw:
            assert draw() == expected


@pytest.mark.usefixtures("two_cores")
def test_a_copy_of_this_process_leaves_the_one_on_standby_alone(gallery, monkeypatch):
    with standby():
        (ready,) = companion._ready
        monkeypatch.setattr(companion, "free_cores", lambda: 0.0)
        assert helps(gallery)
        with monkeypatch.context() as one:
            one.setattr(os, "getpid", lambda: -1)
            assert not helps(gallery)
            assert companion._waiting() is None
        assert ready.program.poll() is None


@pytest.mark.usefixtures("two_cores")
def test_a_report_needs_no_terminal(gallery, expected, monkeypatch):
    with drawing(gallery) as draw:
        left_to(draw)
        monkeypatch.setattr(sys, "stderr", None)
        assert draw() == expected
    monkeypatch.undo()


def test_no_process_is_on_standby_where_somebody_shares_out_the_cores():
    with standby():
        assert companion._ready == []


@pytest.mark.usefixtures("two_cores")
def test_a_second_process_is_started_only_where_it_helps(
    gallery, expected, short_walk, monkeypatch
):
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
    for program in (None, "", "/opt/blender"):
        with monkeypatch.context() as one:
            one.setattr(sys, "executable", program)
            assert not helps(gallery)
    with monkeypatch.context() as one:
        one.setattr(sys, "frozen", True, raising=False)
        assert not helps(gallery)
    with monkeypatch.context() as one:
        one.setattr(companion, "LARGEST", short_walk.nbytes - 1)
        assert not helps(gallery)
    gallery.names = FEW[:3]
    assert not helps(gallery)
    with drawing(gallery) as draw:
        assert draw() == {name: expected[name] for name in FEW[:3]}


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
def test_the_picture_that_takes_longest_is_the_first_of_the_second_process(short_walk):
    gallery = Gallery(short_walk)
    assert gallery.names == (*gallery.kinds, WALK)
    with drawing(gallery) as draw:
        assert draw.__self__._last() == WALK
