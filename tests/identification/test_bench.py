"""The simulated bench, its files, and BAM's files."""

import json
import math

import numpy as np
import pytest

from identification.synthetic_bench import held_out
from phasmid.errors import InvalidInput
from phasmid.identification import (
    BamParameters,
    BenchLog,
    Pendulum,
    load_bam,
    load_bench_log,
    save_bam,
    simulate_logs,
)
from phasmid.identification.parameters import (
    identified_motor,
    identified_servo,
    servo_records,
    start_values,
)
from phasmid.identification.simulation import STEP
from phasmid.servo import Friction, load_servo

AX = load_servo("AX-12A")
LOAD = Pendulum(0.3, 0.15, 0.02)


def released(angle, duration=2.0):
    """Log of a servo without torque that lets the pendulum go at an angle."""
    time = np.arange(0.0, duration, 0.01)
    held = np.full(len(time), angle)
    return BenchLog("released", time, held, held, np.zeros(len(time), bool), LOAD, 12.0)


def test_a_released_pendulum_without_friction_keeps_its_period():
    # Small swings about the hanging angle: period 2 pi sqrt((I + J) / (m g l)), with the rotor's
    # inertia J on stiff gears without play. An amplitude of 0.1 rad lengthens it by a^2/16, 0.06 %.
    values = start_values(AX, "m1", 0.0)
    values |= {"friction": 0.0, "viscous_friction": 0.0, "backlash": 0.0}
    parameters = servo_records(AX, "m1", values, [12.0], STEP)
    parameters["stiffness"], parameters["damping"] = 600.0, 0.0
    log = released(0.3, 5.0)
    (angle,) = simulate_logs([log], parameters, 0.0, 0.2)
    swings = np.flatnonzero((angle[:-1] < 0.2) & (angle[1:] >= 0.2))
    measured = np.diff(log.time[swings]).mean()
    inertia = LOAD.inertia + values["armature"]
    period = 2 * math.pi * math.sqrt(inertia / LOAD.largest_load)
    assert measured == pytest.approx(period, rel=0.01 / (5 * period) + 1e-3)


def test_a_delayed_servo_does_the_same_later():
    values = start_values(AX, "own", 0.0)
    parameters = servo_records(AX, "own", values, [12.0], STEP)
    time = np.arange(0.0, 2.0, STEP)
    on = np.ones(len(time), bool)
    log = BenchLog("steps", time, 0.8 * (time > 0.5), 0 * time, on, LOAD, 12.0)
    prompt, late = (simulate_logs([log], parameters, delay, 0.0)[0] for delay in (0.0, 0.05))
    assert np.allclose(late[50:], prompt[:-50], 0, 1e-12)
    assert np.ptp(late) > 0.7


def test_a_servo_table_has_the_identified_values():
    # Its data sheet gives the same motor again, to round-off.
    rng = np.random.default_rng(3)
    for model in ("own", "m2", "m4", "m6"):
        values = held_out(AX, model, rng)
        servo, motor = identified_servo(AX, model, values), identified_motor(model, values)
        assert servo.motor.constant == pytest.approx(motor.constant, rel=1e-9)
        assert servo.motor.load_loss == pytest.approx(motor.load_loss, abs=1e-9)
        assert servo.delay == values["delay"]


RIGHT = "time [s],target [deg],position [deg]\n"
HEADING = "time [ms],position [deg],target [rad],powered,note\n"


def test_a_csv_has_units_and_columns_in_any_order(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(HEADING + "0,90,1,1,a\n10,180,2,0,b\n")
    log = load_bench_log(path, LOAD, 11.1)
    assert log.time.tolist() == [0.0, 0.01]
    assert np.allclose(log.position, [math.pi / 2, math.pi])
    assert log.target.tolist() == [1.0, 2.0]
    assert log.powered.tolist() == [True, False]
    assert (log.voltage, log.pendulum) == (11.1, LOAD)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", 'no column "time"'),
        ("time [s],target [deg]\n0,1\n", 'no column "position"'),
        ("time [s],target [deg],position [m]\n0,1,2\n", 'has the unit "m"'),
        ("time [s],target [deg],position\n0,1,2\n", 'has the unit ""'),
        (f"{RIGHT}0,1,2\n0,1,2\n", "log row 2: time 0 s does not follow 0 s"),
        (f"{RIGHT}0,1,2\n1,x,2\n", "target in row 2"),
        (f"{RIGHT}0,1,2\n", "has 1 rows"),
        (f"{RIGHT}0,1,2\n9999,1,2\n", "at most 3600 s"),
    ],
)
def test_a_bad_log_is_refused(tmp_path, text, message):
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=message):
        load_bench_log(path, LOAD, 12.0)


@pytest.mark.parametrize("model", ["m1", "m2", "m3", "m4", "m5", "m6"])
def test_files_of_bam_come_back_the_same(tmp_path, model):
    values = held_out(AX, model, np.random.default_rng(1))
    friction = identified_motor(model, values).friction
    saved = BamParameters(model, "mx64", 1.6, 3.9, 0.012, friction, {"q_offset": 0.01})
    save_bam(saved, tmp_path / "a.json")
    assert load_bam(tmp_path / "a.json") == saved


def test_a_file_in_the_form_of_bam_is_read(tmp_path):
    # Keys as BAM's README and parameter files have them; the load friction of M3 counts for both
    # torques.
    content = {
        "kt": 1.5,
        "R": 3.0,
        "armature": 0.01,
        "friction_base": 0.1,
        "friction_viscous": 0.02,
        "load_friction_base": 0.2,
        "model": "m3",
        "actuator": "mx106",
    }
    path = tmp_path / "m3.json"
    path.write_text(json.dumps(content))
    found = load_bam(path)
    assert (found.constant, found.resistance, found.actuator) == (1.5, 3.0, "mx106")
    assert found.friction == Friction(0.1, 0.02, 0.2, 0.2)
    for key, word in (("model", "friction model"), ("friction_base", "lacks friction_base")):
        path.write_text(json.dumps({k: v for k, v in content.items() if k != key}))
        with pytest.raises(InvalidInput, match=word):
            load_bam(path)


@pytest.mark.parametrize(("mass", "length"), [(0.0, 0.1), (0.1, -1.0), (math.nan, 0.1)])
def test_the_bench_needs_a_load(mass, length):
    with pytest.raises(InvalidInput, match="must be positive"):
        Pendulum(mass, length)
