"""The stage: what browsers ask of the live robot, and what they are told."""

import json
import os
import tempfile
import threading
import time
import weakref
from collections import deque
from itertools import chain
from types import SimpleNamespace

import numpy as np
import pytest

from phasmid import load_recording, load_scenario
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.scenario import scenario_to_toml
from phasmid.simulation import new_drive
from phasmid.studio import live_simulation, recorder
from phasmid.studio.fields import catalogue, values
from phasmid.studio.live import LiveRobot
from phasmid.studio.live_simulation import LiveSimulation
from phasmid.studio.messages import (
    Change,
    Limb,
    Load,
    Play,
    Push,
    Record,
    Stick,
)
from phasmid.studio.pacing import Pacing
from phasmid.studio.setting import setting_of
from support.staging import PATIENCE, staged


def test_it_walks_by_itself_at_once_and_tells_newcomers_all(heard):
    kinds = [next(iter(text)) for text in heard.texts]
    assert kinds.index("catalogue") < kinds.index("setting")
    frame = heard.frame()
    assert frame["velocity_command"][0] > 0
    assert heard.newest("setting")["walks"] == "by itself"
    hello = [next(iter(json.loads(text))) for text in heard.stage.hello()]
    assert hello == ["catalogue", "scene", "setting", "state"]
    assert heard.newest("state")["servos"]["holding"] == "HOLDS"
    assert heard.newest("state")["playing"] is True
    heard.wait_for(lambda: heard.newest("state")["status"] == "walks")


def test_every_field_changes_while_it_walks(heard):
    # To another choice than the present one, or to the range's middle.
    start = setting_of(load_scenario("paper"))
    for field in chain(*catalogue(start).values()):
        name, now = field["name"], values(start)[field["name"]]
        if field["kind"] == "choice":
            value = next(word for word in reversed(field["choices"]) if word != now)
        elif field["kind"] == "range":
            value = 0.55 * field["least"] + 0.45 * field["most"]
        else:
            value = not now
        if name == "contact_law":
            value = "mujoco"
        if name == "walks":
            value = "by hand"
        heard.submit(Change(name=name, value=value))
        assert heard.newest("setting")[name] == pytest.approx(value), name
        heard.frame()
        if name == "controller":
            # A learned policy takes neither poses nor other robots.
            heard.submit(Change(name=name, value=now))
    assert heard.submit(Play(how="reset")) == {}
    assert not [event for event in heard.events if "unforeseen" in event["text"]]


def test_what_is_refused_changes_nothing_and_is_said_as_the_command_line_says_it(heard):
    before = heard.newest("setting")
    number = heard.newest("scene")["number"]
    scenario = load_scenario("paper").replace(contact_law="simscape")
    with pytest.raises(InvalidInput) as own:
        new_drive(scenario, None, lambda *_: None)
    file = scenario_to_toml(scenario, "phantomx-paper").encode()
    with pytest.raises(InvalidInput) as told:
        heard.submit(Load(what="scenario", name="x.toml", content=file))
    assert (told.value.what, told.value.hint) == (own.value.what, own.value.hint)
    with pytest.raises(InvalidInput, match=r"terrain\.friction is -1; it must be 0 or more"):
        heard.submit(Change(name="friction", value=-1))
    with pytest.raises(InvalidInput, match='the setting has no field "colour"'):
        heard.submit(Change(name="colour", value=1))
    for request, words in (
        (Push(impulse=(100.0, 0.0, 0.0)), "the push is 100 N·s; it must be at most"),
        (Limb(leg=9, how="lose"), "there is no leg 9; legs are 1 to 6"),
        (Record(on=False), "nothing records"),
    ):
        with pytest.raises(PhasmidError) as refusal:
            heard.submit(request)
        assert words in refusal.value.what
    assert heard.newest("setting") == before
    assert heard.newest("scene")["number"] == number
    assert np.isfinite(heard.frame()["time"])


def test_the_plan_walks_and_says_why_it_does_nothing_else(heard):
    heard.submit(Change(name="walks", value="the plan"))
    heard.submit(Change(name="stance_law", value="coxa-only"))
    with pytest.raises(InvalidInput, match="without a stick"):
        heard.submit(Stick(at=(1.0, 0.0, 0.0)))
    with pytest.raises(InvalidInput, match="without another pose"):
        heard.submit(Change(name="roll", value=3))
    with pytest.raises(InvalidInput, match="without lost legs"):
        heard.submit(Limb(leg=1, how="lose"))
    # A step that no leg can make is refused in the words of the planner.
    heard.submit(Change(name="stance_law", value="straight"))
    with pytest.raises(InvalidInput, match=r"would turn at .* allows"):
        heard.submit(Change(name="period", value=0.3))
    assert heard.newest("setting")["period"] == 2.0
    frame = heard.frame()
    assert np.isnan(frame["velocity_command"]).all()
    assert np.isfinite(frame["foot_position"]).all()


def test_a_stick_takes_over_and_is_let_go_when_it_grows_old(heard):
    heard.submit(Stick(at=(0.0, 0.0, 0.0)))
    assert heard.newest("setting")["walks"] == "by itself"
    heard.submit(Stick(at=(-1.0, 0.0, 0.0)))
    assert heard.newest("setting")["walks"] == "by hand"
    heard.wait_for(lambda: heard.frame()["velocity_command"][0] < 0)
    heard.wait_for(lambda: not heard.frame()["velocity_command"].any())
    heard.wait_for(lambda: heard.newest("state")["status"] == "stands")


def test_without_anybody_who_looks_on_the_stick_is_let_go_and_no_frames_are_made(heard):
    heard.submit(Stick(at=(1.0, 0.0, 0.0)))
    heard.stage.viewers(0)
    live = heard.stage.live
    heard.wait_for(lambda: live.command.velocity == (0.0, 0.0, 0.0))
    count = len(heard.frames)
    now = live.now
    heard.wait_for(lambda: live.now > now + 0.2)
    assert len(heard.frames) <= count + 1


def test_time_stops_goes_by_updates_and_begins_anew(heard):
    heard.submit(Play(how="pause"))
    live = heard.stage.live
    now = live.now
    heard.submit(Play(how="step"))
    assert live.now == pytest.approx(now + 0.005, abs=1e-9)
    assert heard.newest("state")["playing"] is False
    heard.submit(Play(how="reset"))
    assert heard.stage.live.now == 0.0
    # A browser that comes while nothing moves sees the robot too.
    count = len(heard.frames)
    heard.stage.viewers(2)
    heard.wait_for(lambda: len(heard.frames) > count)
    heard.submit(Play(how="play"))
    heard.wait_for(lambda: heard.stage.live.now > 0.1)


def test_a_leg_is_lost_and_there_again_and_dead_until_the_robot_is_put_back(heard):
    heard.submit(Limb(leg=2, how="lose"))
    heard.event("leg right middle is lost.")
    heard.wait_for(lambda: heard.newest("state")["lost"] == [2])
    heard.submit(Limb(leg=2, how="restore"))
    heard.wait_for(lambda: heard.newest("state")["lost"] == [])
    heard.submit(Limb(leg=5, how="limp"))
    heard.event("servo left_middle.coxa answers no more")
    with pytest.raises(InvalidInput, match="dead for as long"):
        heard.submit(Limb(leg=5, how="restore"))
    heard.submit(Play(how="reset"))
    heard.wait_for(lambda: heard.newest("state")["dead"] == [])


def test_a_lost_leg_without_which_the_robot_falls_is_named(heard):
    """Without all three legs of a side it would fall: it needs at least one of them."""
    for leg in (1, 2, 3):
        heard.submit(Limb(leg=leg, how="lose"))
    heard.wait_for(lambda: heard.newest("state")["status"] == "cannot walk")
    heard.event("is lost and stays on the ground: without it the robot falls")
    assert heard.newest("state")["lost"] == [1, 2, 3]
    heard.wait_for(lambda: heard.newest("state")["needed"])
    assert set(heard.newest("state")["needed"]) <= {1, 2, 3}
    for leg in (1, 2, 3):
        heard.submit(Limb(leg=leg, how="restore"))
    heard.wait_for(lambda: heard.newest("state")["needed"] == [])


@pytest.fixture
def held(heard, monkeypatch):
    """A stage whose changes are ready only when this event is set."""
    go, usual = threading.Event(), heard.stage._make

    def made(request):
        ready = usual(request)
        assert go.wait(PATIENCE)
        return ready

    monkeypatch.setattr(heard.stage._builder, "_make", made)
    yield go
    go.set()


@pytest.mark.parametrize(
    "request_",
    [
        Change(name="terrain", value="stairs"),
        Change(name="gait", value="wave"),
        Play(how="reset"),
        Load(what="terrain", name="hills.csv", content=b"0,0\n0,0\n"),
    ],
)
def test_the_robot_walks_on_until_a_change_is_ready(request_, heard, held):
    live, answer = heard.stage.live, heard.stage.submit(request_)
    now = live.now
    heard.wait_for(lambda: live.now > now + 0.2)
    heard.submit(Stick(at=(-1.0, 0.0, 0.0)))
    assert heard.newest("setting")["walks"] == "by hand"
    assert heard.stage.live is live
    assert not answer.done()
    held.set()
    assert answer.result(PATIENCE) == {}
    # The stick that took over meanwhile keeps the robot.
    assert heard.newest("setting")["walks"] == "by hand"
    assert (heard.stage.live is live) is (request_ == Change(name="gait", value="wave"))


def test_a_leg_lost_while_a_change_is_made_ready_stays_lost(heard, held):
    answer = heard.stage.submit(Change(name="payload", value=0.2))
    heard.submit(Limb(leg=2, how="lose"))
    held.set()
    answer.result(PATIENCE)
    heard.wait_for(lambda: heard.newest("setting")["payload"] == 0.2)
    assert heard.newest("state")["lost"] == [2]
    assert heard.stage.live.command.lost_legs == {2}


def test_requests_of_many_leave_the_robot_its_time(heard, monkeypatch):
    # Each takes as long as a turn may; a thousand of them would stop it for half a minute.
    monkeypatch.setattr(LiveSimulation, "_push", lambda *_: time.sleep(live_simulation.BUDGET))
    live, now = heard.stage.live, heard.stage.live.now
    answers = [heard.stage.submit(Push(impulse=(0.0, 0.0, 0.0))) for _ in range(1000)]
    heard.wait_for(lambda: live.now > now + 0.5)
    assert not answers[-1].done()
    for answer in answers:
        answer.cancel()


def test_robots_that_were_replaced_leave_no_memory(heard):
    robots = []
    for payload in (0.1, 0.2, 0.3, 0.4):
        heard.submit(Change(name="payload", value=payload))
        robots.append(weakref.ref(heard.stage.live))
    heard.frame()
    assert [robot() is None for robot in robots] == [True, True, True, False]


def test_a_robot_that_fell_is_shown_and_put_back(heard, monkeypatch):
    monkeypatch.setattr(live_simulation, "LYING", 0.2)
    number = heard.newest("scene")["number"]
    # All at one moment: it falls before the last one dies otherwise.
    heard.submit(Play(how="pause"))
    for leg in range(1, 7):
        heard.submit(Limb(leg=leg, how="limp"))
    heard.submit(Play(how="play"))
    told = heard.wait_for(
        lambda: next((t["state"] for t in heard.texts if t.get("state", {}).get("sentence")), None)
    )
    assert told["status"] == "fell"
    assert told["sentence"].startswith("The robot fell at ")
    heard.wait_for(lambda: heard.newest("scene")["number"] > number)
    heard.wait_for(lambda: heard.newest("state")["sentence"] == "")
    assert heard.newest("state")["dead"] == []
    assert heard.stage.live.failure is None


def test_a_fault_that_nobody_foresaw_ends_nothing(heard, monkeypatch):
    def faulty(*_):
        raise ZeroDivisionError("as a test has it")

    monkeypatch.setattr(LiveRobot, "advance", faulty)
    heard.event("an unforeseen fault, ZeroDivisionError: as a test has it; the robot is put back")
    heard.event("with the usual setting, and waits")
    monkeypatch.undo()
    heard.wait_for(lambda: heard.newest("state")["playing"] is False)
    assert heard.submit(Change(name="friction", value=0.5)) == {}
    # The exception of a request itself: the server answers that the fault is ours.
    monkeypatch.setattr(LiveSimulation, "_changed", faulty)
    with pytest.raises(ZeroDivisionError, match="as a test has it"):
        heard.submit(Change(name="friction", value=0.5))
    monkeypatch.undo()
    heard.submit(Play(how="play"))
    heard.wait_for(lambda: heard.stage.live is not None and heard.stage.live.now > 0.05)


def test_a_recording_that_is_cut_off_can_be_read(tmp_path):
    with staged(tmp_path) as heard:
        run = heard.submit(Record(on=True))["run"]
        with pytest.raises(InvalidInput, match="a recording goes on"):
            heard.submit(Record(on=True))
        heard.submit(Push(impulse=(0.0, 0.1, 0.0)))
        heard.wait_for(lambda: heard.stage._recorder.seconds > 0.3)
    with pytest.raises(InvalidInput, match="closed"):
        heard.submit(Play(how="pause"))
    recording = load_recording(tmp_path / f"{run}-log" / f"{run}.mcap")
    assert recording.attrs["ending"] == "CUT"
    assert recording.attrs["ending_reason"] == "The run was cut off."
    assert float(recording.time[0]) == 0.0
    assert np.diff(recording.time.values) == pytest.approx(0.001, abs=1e-9)
    assert "a push of 0.1 N·s." in recording.attrs["events"]
    for name in ("joint_torque", "foot_force", "body_position", "velocity_command", "stance"):
        assert np.isfinite(recording[name].values).all(), name


def test_loaded_files_are_removed_at_the_end(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with staged(tmp_path / "out") as heard:
        assert not list(tmp_path.iterdir())
        heard.submit(Load(what="terrain", name="hills.csv", content=b"0,0\n0,0\n"))
        [folder] = tmp_path.iterdir()
        assert [path.name for path in folder.iterdir()] == ["hills.csv"]
    assert not list(tmp_path.iterdir())


def test_a_recording_that_is_too_long_or_too_short_ends_with_a_word(heard, monkeypatch):
    monkeypatch.setattr(recorder, "LONGEST", 0.2)
    heard.submit(Record(on=True))
    heard.event("min long and ends.")
    heard.wait_for(lambda: heard.newest("state")["recording"] is None)
    heard.submit(Play(how="pause"))
    heard.submit(Record(on=True))
    with pytest.raises(InvalidInput, match="has no sample"):
        heard.submit(Record(on=False))


def test_no_more_than_two_recordings_are_written_at_a_time(heard, monkeypatch):
    monkeypatch.setattr(heard.stage._recorder, "_jobs", [None, None])
    monkeypatch.setattr(heard.stage._recorder, "finished", list)
    with pytest.raises(InvalidInput, match="2 recordings are still being written"):
        heard.submit(Record(on=True))
    monkeypatch.undo()


@pytest.mark.skipif(os.name == "nt", reason="Windows knows no sessions")
def test_a_ctrl_c_in_the_terminal_does_not_reach_who_writes_a_report(tmp_path):
    writer = recorder.Recorder(tmp_path)
    writer._write("r-0000", tmp_path / "run")
    try:
        # A terminal's signals go to one group of processes, within one session.
        assert os.getsid(writer._jobs[0].process.pid) != os.getsid(0)
    finally:
        writer.close()


def test_a_saved_run_is_a_folder_like_any_other(heard, tmp_path):
    heard.submit(Change(name="gait", value="wave"))
    run = heard.submit(Record(on=True))["run"]
    heard.wait_for(lambda: heard.stage._recorder.seconds > 1.0)
    assert heard.submit(Record(on=False)) == {"run": run}
    event = heard.event("saved as")
    assert event["run"] == run
    folder = heard.stage.folder(run)
    # It is named by what was walked, also in its summary, and a second one gets a number.
    drive = heard.newest("setting")["drive"]
    assert folder == tmp_path / f"phantomx-paper-wave-flat-{drive}"
    assert load_scenario(folder / "scenario.toml").name == folder.name
    assert heard.stage._recorder._free_folder(folder.name).name == f"{folder.name}-2"
    assert {"report.html", "recording.nc", "summary.json", "scenario.toml", "robot.toml"} <= {
        path.name for path in folder.iterdir()
    }
    recording = load_recording(folder)
    assert float(recording.time[-1]) > 1.0
    assert load_scenario(folder / "scenario.toml").gait.name == "wave"
    assert not (tmp_path / f"{run}-log").exists()
    assert heard.stage.folder("../etc") is None


# Clock and meter --------------------------------------------------------------------------------


def test_updates_follow_the_clock_times_the_pace():
    pacing = Pacing()
    pacing.begin(10.0, 0.0)
    pacing.factor = 2.0
    assert pacing.due(10.033, 0.0, 0.005) == 13
    # What is left of an update is not lost.
    assert pacing.due(10.0345, 0.065, 0.005) == 0
    assert pacing.due(10.035, 0.065, 0.005) == 1
    # A slow machine falls behind, by a tenth of a second at most, and the pace says so.
    assert pacing.due(11.0, 0.07, 0.005) == 41
    assert pacing.measured == pytest.approx(0.07 / 0.967)


def test_metrics_are_speed_power_and_cost_of_the_last_cycle():
    # A robot of 20 N on a circle of 0.5 m at 0.2 m/s, whose joints give 1.5 W.
    marks = [
        (t, 0.5 * np.sin(0.4 * t), 0.5 * (1 - np.cos(0.4 * t)), 0.4 * t, 1.5 * t)
        for t in np.arange(0, 10, 0.01)
    ]
    live = LiveRobot(setting_of(load_scenario("paper").replace(period=1.0)))
    live._marks = deque(map(np.array, marks))
    live.source = SimpleNamespace(weight=20.0)
    metrics = live.metrics
    # The chord of an arc of 0.4 rad is shorter by a share of 0.4²/24.
    chord = 0.2 * (1 - 0.4**2 / 24)
    assert metrics.velocity == pytest.approx((chord, 0.0, 0.4), abs=1e-4)
    assert metrics.power == pytest.approx(1.5)
    assert metrics.cost_of_transport == pytest.approx(1.5 / (20.0 * chord), rel=1e-3)
