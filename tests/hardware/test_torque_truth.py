"""What is said of the torque against the registers of the servos: stages, faults and ends.

In virtual time; registers are read past the bus. `make slow SUITE=bus` runs all cells, the tests a
dozen of them.
"""

import math
import os
import signal

import numpy as np
import pytest

from phasmid.hardware.stages import LONGEST_RAMP, LONGEST_RISE, WALK_EXCESS, WALK_STRETCH, Stage
from phasmid.recording import load_recording
from support.virtual_bus import folded, new_driver, virtual_bus

WHOLE = bool(os.environ.get("PHASMID_FAULT_SEEDS"))

DURATION = 1.5
"""Time of walking [s]."""

OVERRUN = 1.5
"""Time by which ticks with lost answers may last longer, in all stages together [s]."""

STOP_TIME = 25.0
"""Longest time from the first Ctrl-C to the end of the drive [s]."""

STAGES = {
    "ramp": (Stage.RAMP, 0.4),
    "rise": (Stage.RISE, 1.0),
    "stand": (Stage.WALK, 1.0),
    "walk": (Stage.WALK, 1.0),
    "sit": (Stage.SIT, 0.4),
}
"""Stage in which a fault begins, and the time from the stage's beginning [s]."""


def lose_port(clock, bus, duration):
    bus.port.lost = True
    if math.isfinite(duration):
        clock.at(clock.now + duration, lambda: setattr(bus.port, "lost", False))


def add(*texts):
    """Return the action that adds faults of the emulator."""

    def act(emulator, clock, bus):
        for text in texts:
            emulator.faults.add(text, emulator.faults.time)

    return act


FAULTS = {
    "none": add(),
    "silent": add("lost 1"),
    "garbled": add("garbled 1"),
    "late": add("late 1 by 50 ms"),
    "15 % lost": add("lost 0.15"),
    "50 % lost": add("lost 0.5"),
    "95 % lost": add("lost 0.95"),
    "lost, garbled and late": add("lost 0.1", "garbled 0.05", "late 0.1 by 50 ms"),
    "port gone": lambda emulator, clock, bus: lose_port(clock, bus, math.inf),
    "second reader": lambda emulator, clock, bus: lose_port(clock, bus, 1.0),
    "overload": add("5 overload"),
    "hot": add("5 hot"),
    "low supply": lambda emulator, clock, bus: emulator.plant.voltage.fill(6.1),
    "two legs dead": add("5 dead", "14 dead"),
    "a leg's cable": add("4 dead", "5 dead", "6 dead"),
}

ENDS = "none", "Ctrl-C twice"

CELLS = [
    ("ramp", "silent", "none", "AX-12A"),
    ("ramp", "overload", "none", "AX-12A"),
    ("ramp", "overload", "none", "MX-28"),
    ("rise", "port gone", "none", "AX-12A"),
    ("rise", "overload", "none", "AX-12A"),
    ("stand", "second reader", "none", "XL430-W250"),
    ("walk", "garbled", "Ctrl-C twice", "AX-12A"),
    ("walk", "95 % lost", "none", "XL430-W250"),
    ("walk", "late", "none", "AX-12A"),
    ("sit", "15 % lost", "none", "AX-12A"),
    ("sit", "two legs dead", "none", "AX-12A"),
    ("walk", "a leg's cable", "none", "AX-12A"),
    ("walk", "a leg's cable", "none", "XL430-W250"),
    ("sit", "low supply", "Ctrl-C twice", "AX-12A"),
]
if WHOLE:
    CELLS = [
        (stage, fault, end, servo)
        for servo in ("AX-12A", "MX-28", "XL430-W250")
        for stage in STAGES
        for fault in FAULTS
        for end in ENDS
    ]


@pytest.mark.parametrize(("stage", "fault", "end", "servo"), CELLS)
def test_what_is_said_of_the_torque_is_true(monkeypatch, tmp_path, stage, fault, end, servo):
    """In each cell, at the end:

    - "the torque is off" was said if and only if no servo is named; then all registers are 0.
    - A servo whose torque is on is named with "switch the supply off", and the status is not 0.
    - A servo that has shut down runs at no time afterwards.
    - The drive ends within the sum of its stages, and within 25 s of a Ctrl-C.
    - The log states the same ending.
    """
    entered, delay = STAGES[stage]
    begun, stopped, entries, starts = [], [], [], []
    velocity = (0.0, 0.0, 0.0) if stage == "stand" else (0.06, 0.0, 0.0)
    with virtual_bus(monkeypatch, name=servo, plant=folded(servo), seed=3) as parts:
        *robot, bus, emulator, clock = parts
        driver = new_driver(*robot, bus, velocity=velocity, log=tmp_path / "a.mcap")

        def strike():
            begun.append(clock.now)
            FAULTS[fault](emulator, clock, bus)
            if end == "Ctrl-C twice":
                clock.at(clock.now + 0.5, interrupt)
                clock.at(clock.now + 1.5, interrupt)

        def interrupt():
            stopped.append(clock.now)
            if driver.stage is not Stage.OFF:
                signal.raise_signal(signal.SIGINT)

        def look():
            # The ramp begins where the last servo has its torque.
            is_entered = driver.stage is entered and emulator.servos[-1]["torque_enable"]
            if is_entered:
                entries.append(clock.now)
            if entries and clock.now >= entries[0] + delay:
                strike()
            else:
                clock.at(clock.now + 0.01, look)

        clock.at(0.0, look)
        driver.on_event = lambda time, _: starts.append(clock.now - time)
        # A signal after the drive is that of the test.
        monkeypatch.setattr(signal, "default_int_handler", lambda *_: None)
        report = driver.drive(DURATION)
        finished = clock.now
    assert begun
    _, enabled, _, _ = emulator.traces()
    on = {
        name for name, one in zip(driver.robot.names, emulator.servos, strict=True) if one.enabled
    }
    sentences = [sentence for _, sentence in report.events]
    assert on <= set(report.unconfirmed)
    assert ("the torque is off." in sentences) == (not report.unconfirmed)
    assert ("switch the supply off" in sentences[-1]) == bool(report.unconfirmed)
    if report.unconfirmed:
        assert report.ending.ending.name == "ABORTED"
        assert "not confirmed" in report.ending.sentence
    if fault in ("overload", "hot"):
        after = np.array([row[0] for row in emulator.history]) > begun[0] + 0.05
        assert not enabled[after, 4].any()
        assert report.ending is not None or fault == "overload"
    if fault == "a leg's cable":
        # 15 servos answer.
        assert not any("no servo answers" in sentence for sentence in sentences)
    if fault == "two legs dead":
        assert report.ending.ending.name == "ABORTED"
    if fault == "none":
        name = report.ending.ending.name if report.ending else None
        assert name == ("STOPPED" if end == "Ctrl-C twice" else None)
    settings = driver.settings
    last = settings.sit_time + settings.ramp_time + settings.off_time + OVERRUN
    before = (
        settings.ramp_time + LONGEST_RAMP + LONGEST_RISE + WALK_STRETCH * DURATION + WALK_EXCESS
    )
    assert finished - starts[0] < before + last
    if stopped:
        assert finished - stopped[0] < STOP_TIME
    if (tmp_path / "a.mcap").exists():
        ending = report.ending.ending.name if report.ending else "COMPLETED"
        assert load_recording(tmp_path / "a.mcap").attrs["ending"] == ending
