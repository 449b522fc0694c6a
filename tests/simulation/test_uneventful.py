"""Updates that machine code makes at once, beside the same ones made by Python one by one."""

from __future__ import annotations

import numpy as np
import pytest

from phasmid import load_scenario
from phasmid.control import Command, LocomotionEngine, SafetySettings, script_from_text
from phasmid.simulation import uneventful
from phasmid.simulation.driven import DrivenRun
from phasmid.simulation.driving import Driving
from phasmid.simulation.uneventful_loop import FAILED, TROUBLE

PAPER = load_scenario("paper").replace(period=1.0, duration=1.6)
AHEAD = Command(velocity=(0.05, 0.0, 0.1))
SCRIPT = """
format = 1
duration = 1.303
[[command]]
time_s = 0
ahead_mm_per_s = 50
[[command]]
time_s = 0.502
left_mm_per_s = 40
[[command]]
time_s = 0.9
turn_deg_per_s = 20
[[command]]
time_s = 1.035
"""
# The last comes with the second update of the run's third block.

EVENLY = """
format = 1
between = "linear"
[[command]]
time_s = 0
[[command]]
time_s = 0.3
ahead_mm_per_s = 50
"""


def driving(changes, commands=AHEAD, faults=(), *, bare=False):
    scenario = PAPER.replace(**changes)
    controller = LocomotionEngine(scenario.load_robot()) if bare else None
    return Driving.of(scenario, controller, commands, rate=200.0, between=None, faults=faults)


@pytest.fixture
def made(monkeypatch):
    """How many steps machine code has made."""
    count, go_on = [0], DrivenRun._go_on

    def counted(run, at, most):
        steps = go_on(run, at, most)
        count[0] += steps
        return steps

    monkeypatch.setattr(DrivenRun, "_go_on", counted)
    return count


def by_python(monkeypatch, recorded):
    """What is recorded where Python makes every update."""
    with monkeypatch.context() as patch:
        patch.setattr(DrivenRun, "_go_on", lambda *_: 0)
        return recorded()


@pytest.mark.parametrize(
    ("changes", "commands", "faults"),
    [
        ({"drive": "prescribed"}, AHEAD, ()),
        ({"drive": "ideal-servo", "record_interval": 0.003}, AHEAD, ()),
        ({"drive": "servo", "robot": "phantomx-mk4", "terrain": "blocks"}, AHEAD, ()),
        ({"drive": "servo"}, script_from_text(SCRIPT), ()),
        ({"drive": "servo", "gait": "ripple"}, AHEAD, ()),
        ({"drive": "ideal-servo"}, script_from_text(EVENLY), ()),
        ({"drive": "ideal-servo", "robot": "quadruped", "gait": "crawl"}, AHEAD, ()),
        ({"drive": "ideal-servo", "robot": "octopod", "gait": "tetrapod"}, AHEAD, ()),
        ({"drive": "ideal-servo"}, AHEAD, ("right_middle.tibia dead at 0.803 s",)),
    ],
    ids=[
        "prescribed",
        "ideal",
        "blocks",
        "script",
        "ripple",
        "evenly",
        "sways",
        "eight-legs",
        "dead-servo",
    ],
)
def test_a_recording_has_the_bits_of_updates_made_by_python(
    monkeypatch, made, changes, commands, faults
):
    # Both compute the same in the same order: no bit of any channel may differ, nor a sentence.
    found = driving(changes, commands, faults).simulate()
    # It takes part at all: of what happens before a servo dies, and else of most.
    assert made[0] > (0.3 if faults else 0.6) * found.sizes["time"]
    wanted = by_python(monkeypatch, driving(changes, commands, faults).simulate)
    assert found.attrs == wanted.attrs
    assert found.data_vars.keys() == wanted.data_vars.keys()
    for name, values in wanted.data_vars.items():
        assert found[name].values.tobytes() == values.values.tobytes(), name


def test_forces_within_limits_are_found_without_an_update_of_pythons(monkeypatch, made):
    # In a ripple gait one of the cheapest forces would have to pull in one update of fourteen.
    found, find = [], uneventful.Uneventful._finds_forces

    def noted(updates):
        found.append(find(updates))
        return found[-1]

    monkeypatch.setattr(uneventful.Uneventful, "_finds_forces", noted)
    recording = driving({"drive": "servo", "gait": "ripple"}).simulate()
    assert found.count(True) > 10
    # Without them there would be as many more of Python's, of five steps each.
    assert recording.sizes["time"] - made[0] < 5 * found.count(True)


def test_what_a_motion_takes_is_known_as_after_updates_of_pythons(monkeypatch, made):
    # Forces, torques, friction and demand of the last update, however it was made: to the bit.
    def efforts():
        run = driving({"drive": "servo", "gait": "ripple"}).begin_run()
        dynamics, told = run.controller.controller.walker.dynamics, []
        for until in range(400, 1600, 25):
            run.advance(until=until)
            effort = dynamics.effort
            rest = effort.part, effort.friction, effort.demand, dynamics.velocity_share
            told.append((effort.torque.tobytes(), effort.force.tobytes(), effort.remark, *rest))
        return told

    found = efforts()
    assert made[0] > 600
    assert found == by_python(monkeypatch, efforts)


def test_an_engine_with_no_safety_around_it_is_driven_alike(monkeypatch, made):
    def driven():
        return driving({"drive": "servo", "robot": "phantomx-ax"}, bare=True).simulate()

    found = driven()
    assert made[0] > 0.6 * found.sizes["time"]
    wanted = by_python(monkeypatch, driven)
    for name, values in wanted.data_vars.items():
        assert found[name].values.tobytes() == values.values.tobytes(), name


def test_a_push_and_a_death_that_come_by_hand_count_from_the_next_update(monkeypatch, made):
    def ends():
        run = driving({"drive": "ideal-servo"}).begin_run(endless=True)
        kept = []
        for until in (515, 1030, 1545, 2060):
            run.advance(until=until, keep=lambda rows: kept.append(rows.qpos.copy()))
            if until == 515:
                run.push((0.2, 0.1, 0.0))
            if until == 1030:
                run.let_die(1, 2)
        return np.concatenate(kept)

    found = ends()
    assert made[0] > 600
    assert found.tobytes() == by_python(monkeypatch, ends).tobytes()


@pytest.mark.parametrize("harm", ["error", "warning"])
def test_trouble_is_told_as_python_tells_it(monkeypatch, harm):
    # An error of the engine's, or a force that leaves no number, after an update of Python's in the
    # run's second block: the next would be that of machine code, which tells of either.
    told, make_updates, go_on = [], uneventful.make_updates, DrivenRun._go_on

    def make(*given):
        told.append(make_updates(*given))
        return told[-1]

    def trouble(first):
        def harmed(run, at, most):
            if run.now >= 520 and harm == "error":
                run.model.opt.integrator = 99
            elif run.now >= 520:
                run.data.qfrc_applied[8] = 1e14
            return first(run, at, most)

        with monkeypatch.context() as patch:
            patch.setattr(uneventful, "make_updates", make)
            patch.setattr(uneventful, "is_kept", lambda _: True)
            patch.setattr(DrivenRun, "_go_on", harmed)
            return driving({"drive": "ideal-servo"}).begin_run().advance()

    found = trouble(go_on)
    assert told[-1][1] == (FAILED if harm == "error" else TROUBLE)
    assert found is not None
    assert found == trouble(lambda *_: 0)


def test_trouble_in_an_update_of_pythons_is_told_at_once(monkeypatch):
    def trouble(first):
        advance = DrivenRun._advance

        def harmed(run, rows, **options):
            if run.data.time > 0.514:
                run.model.opt.integrator = 99
            return advance(run, rows, **options)

        with monkeypatch.context() as patch:
            patch.setattr(DrivenRun, "_advance", harmed)
            patch.setattr(DrivenRun, "_go_on", first)
            return driving({"drive": "ideal-servo"}).begin_run().advance()

    found = trouble(DrivenRun._go_on)
    assert found is not None
    assert found == trouble(lambda *_: 0)


@pytest.mark.parametrize("change", ["friction", "tilt"])
def test_settings_that_change_in_a_run_count_from_then_on(monkeypatch, made, change):
    def changed():
        begun = driving({"drive": "ideal-servo"})
        run, kept = begun.begin_run(), []
        for until in (515, 1600):
            run.advance(until=until, keep=lambda rows: kept.append(rows.qpos.copy()))
            if change == "friction":
                run.controller.controller.walker.dynamics.feed.friction = 0.02
            else:
                run.controller.guard.settings = SafetySettings(tilt_share=0.01)
        return np.concatenate(kept), run.controller.events

    found = changed()
    assert made[0] > 400
    wanted = by_python(monkeypatch, changed)
    assert found[0].tobytes() == wanted[0].tobytes()
    assert found[1] == wanted[1] != []


@pytest.mark.parametrize("whose", ["controller", "guard"])
def test_methods_that_somebody_puts_in_are_called_at_every_update(made, whose):
    drive = driving({"drive": "ideal-servo", "duration": 0.5})
    part, name = drive.controller, "update"
    if whose == "guard":
        part, name = drive.controller.guard, "check"
    update, seen = getattr(part, name), []

    def watched(observation, command):
        seen.append(observation.time)
        return update(observation, command)

    setattr(part, name, watched)
    drive.simulate()
    assert made[0] == 0
    np.testing.assert_allclose(seen, np.arange(101) * 5e-3, atol=1e-12)


def test_python_makes_all_updates_where_a_stage_has_no_machine_code(monkeypatch, made):
    def none(*_):
        raise OSError("none")

    monkeypatch.setattr(uneventful, "address_of", none)
    recording = driving({"drive": "ideal-servo", "duration": 0.5}).simulate()
    assert recording.attrs["ending"] == "COMPLETED"
    assert made[0] == 0
