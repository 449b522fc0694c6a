"""Parameters of a servo found again in logs of a simulated bench."""

import math
from functools import cache

import numpy as np
import pytest

from identification.synthetic_bench import held_out, synthetic_logs
from phasmid.cli import main
from phasmid.errors import InvalidInput
from phasmid.identification import Determined, identify
from phasmid.servo import load_servo

AX, XL = load_servo("AX-12A"), load_servo("XL430-W250")


@cache
def found_again(name, model, seed, names=(), fixed=()):
    """Values that were put in, and the identification."""
    rng, servo = np.random.default_rng(seed), load_servo(name)
    values = held_out(servo, model, rng)
    logs = synthetic_logs(servo, model, values, rng, names)
    return values, identify(logs, servo, model=model, fixed=fixed)


@pytest.mark.parametrize(
    ("name", "model"),
    [pytest.param("AX-12A", "own", marks=pytest.mark.slow), ("XL430-W250", "m1")],
)
def test_what_is_determined_is_within_five_per_cent(name, model):
    # Steps of 0.29 and 0.09 deg, noise of 0.1 deg, one load, five motions of 6 s.
    values, found = found_again(name, model, 0)
    sure = 0
    for one, value, size, how in zip(
        found.names, found.values, found.sizes, found.determined, strict=True
    ):
        if how is Determined.YES:
            assert abs(value - values[one]) <= 0.05 * size, one
            sure += 1
    assert sure >= 8
    if name == "AX-12A":
        assert found.all_values["compliance_margin"] == values["compliance_margin"]
        assert Determined.NO not in found.determined
    # The noise, and the step's 1/sqrt(12) in which it is read.
    step = load_servo(name).resolution
    expected = math.hypot(math.radians(0.1), step / math.sqrt(12))
    assert found.rms_error == pytest.approx(expected, rel=0.1)


def test_with_the_torque_always_on_brake_and_viscous_friction_trade_off():
    # The winding brakes with k^2/R w, which no angle tells from b w: the sum is well known, and
    # b alone is not.
    _, found = found_again("XL430-W250", "m1", 2, ("slow",))
    named = {name for one in found.trade_offs for name in one.changes}
    assert "viscous_friction" in named
    how = dict(zip(found.names, found.determined, strict=True))
    assert how["viscous_friction"] is Determined.NO


def test_names_of_unknown_parameters_and_short_logs_are_refused():
    logs = synthetic_logs(AX, "own", held_out(AX, "own", np.random.default_rng(0)), RNG, ("slow",))
    with pytest.raises(InvalidInput, match='no parameter "slop"'):
        identify(logs, AX, fixed=("slop",))
    with pytest.raises(InvalidInput, match="no log"):
        identify([], AX)


RNG = np.random.default_rng(1)


def test_the_command_prints_a_table_and_writes_its_files(here, capsys):
    # M2 of the AX-12A with its law fixed; the exit status says that something is determined.
    values = held_out(AX, "m1", RNG)
    fixed = ("compliance_margin", "compliance_slope", "punch")
    for name in fixed:
        values[name] = {"compliance_margin": 1.0, "compliance_slope": 32.0, "punch": 32.0}[name]
    (log,) = synthetic_logs(AX, "m1", values, RNG, ("two-tones",))
    rows = np.column_stack([log.time, np.degrees(log.target), np.degrees(log.position)])
    heading = "time [s],target [deg],position [deg]"
    np.savetxt("log.csv", rows, fmt="%.4f", delimiter=",", header=heading, comments="")
    load = ["--mass-g", "300", "--length-mm", "150", "--arm-mass-g", "20"]
    files = ["--out", "servo.toml", "--bam", "m1.json", "--figure", "fit.svg"]
    arguments = ["identify", "log.csv", *load, "--model", "m1", "--fix", ",".join(fixed), *files]
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert all(len(line) <= 80 for line in printed.partition("\n\nT")[0].splitlines())
    assert "motor_constant" in printed
    assert "rms error" in printed
    for file in ("servo.toml", "m1.json", "fit.svg"):
        assert (here / file).stat().st_size > 100
    assert main(arguments) == 2
    assert "exists" in capsys.readouterr().err
