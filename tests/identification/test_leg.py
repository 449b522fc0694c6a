"""A leg in the air: its simulation, its logs, and the servo found again in them."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import phasmid
from identification.synthetic_bench import held_out, read, walks, write_csv
from phasmid.cli import main
from phasmid.dynamics import leg_torque
from phasmid.dynamics.leg_kernels import leg_acceleration
from phasmid.dynamics.matrices import hip_gravity, link_moments
from phasmid.errors import InvalidInput
from phasmid.formats import load_robot
from phasmid.identification import BenchLog, Determined, Pendulum, identify, simulate_logs
from phasmid.identification.logs import compared_rows
from phasmid.identification.parameters import servo_records, start_values
from phasmid.identification.simulation import STEP, time_step
from phasmid.servo.law import SERVO_STATE
from phasmid.servo.law_kernels import servo_step
from phasmid.simulation.model import model_specification

ROBOT = load_robot("phantomx-ax")
SERVO, LEG = ROBOT.servo, ROBOT.legs[0]


def test_the_acceleration_of_a_leg_needs_its_torque():
    # Forward dynamics inverts the inverse dynamics, to round-off.
    rng, gravity = np.random.default_rng(0), 9.81
    for leg in (LEG, load_robot("quadruped").legs[1]):
        links = leg.lengths, *link_moments(leg), hip_gravity(leg, gravity)
        for _ in range(20):
            q, qd, torque = rng.normal(size=(3, 3)) * [[1], [5], [0.5]]
            qdd = np.empty(3)
            leg_acceleration(*links, q, qd, torque, qdd)
            assert np.allclose(leg_torque(leg, q, qd, qdd, gravity=gravity), torque, 0, 1e-9)


def test_a_leg_in_the_air_moves_as_in_mujoco():
    # The same servos on MuJoCo's model of the robot, its trunk fixed. Both integrate by symplectic
    # Euler; friction and backlash make round-off of 1e-16 grow, for 1 s to less than 1e-6 rad.
    (log,) = walks(ROBOT, ("middle",))
    log = replace(log, time=log.time[:100], target=log.target[:100], position=log.position[:100])
    records = servo_records(SERVO, "own", start_values(SERVO, "own", 0.0), [12.0], STEP)
    (angles,) = simulate_logs([log], records, 0.0)
    scenario = phasmid.load_scenario("paper").replace(robot=ROBOT, drive="servo", dt=STEP)
    spec = model_specification(scenario.build())
    spec.delete(spec.body("trunk").joints[0])
    spec.body("trunk").pos = [0.0, 0.0, 1.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:3] = log.position[0]
    servos, applied = np.zeros(3, SERVO_STATE), np.zeros(3)
    servos["angle"] = log.position[0]
    limits, delayed = LEG.joint_limits.T.copy(), np.empty((3, 0))
    expected = np.empty_like(angles)
    for k in range(len(log.time)):
        expected[k] = data.qpos[:3]
        for _ in range(10):
            joints = data.qpos[:3], data.qvel[:3]
            servo_step(log.target[k], *joints, limits, records, servos, delayed, applied)
            data.qfrc_applied[:3] = applied
            mujoco.mj_step(model, data)
    assert np.ptp(angles, axis=0).min() > 0.05
    assert np.abs(angles - expected).max() < 1e-6


def test_a_light_leg_gets_a_shorter_time_step():
    log = next(walks(ROBOT))
    light = replace(LEG.tibia, mass=1e-3, inertia=LEG.tibia.inertia * 1e-3)
    assert time_step([log], SERVO) == STEP
    short = time_step([replace(log, leg=replace(LEG, tibia=light))], SERVO)
    assert short < STEP
    assert STEP / short == pytest.approx(round(STEP / short))


def test_joints_without_load_are_not_compared():
    # The coxa's axis is vertical; the femur carries the leg throughout.
    log = next(walks(ROBOT))
    kept = compared_rows(log)
    assert not kept[:, 0].any()
    assert kept[-100:, 1].all()
    position = log.position.copy()
    position[-5, 1] = np.nan
    assert not compared_rows(replace(log, position=position))[-5, 1]


@pytest.mark.slow
def test_a_walk_in_the_air_shows_the_motor_and_not_viscous_friction():
    # The torque is always on: the motor's brake k²/R and b slow the servo alike.
    fixed = ("compliance_margin", "compliance_slope", "punch")
    rng, known = np.random.default_rng(1), start_values(SERVO, "own", 0.0)
    values = held_out(SERVO, "own", rng) | {name: known[name] for name in fixed}
    logs = read(list(walks(ROBOT, ("middle", "fast"))), SERVO, "own", values, rng)
    found = identify(logs, SERVO, fixed=fixed)
    how = dict(zip(found.names, found.determined, strict=True))
    assert "hanging" not in how
    assert how["viscous_friction"] is Determined.NO
    assert any("viscous_friction" in one.changes for one in found.trade_offs)
    error = np.abs(found.values - [values[name] for name in found.names])
    assert (error <= 2 * found.half_widths).all()
    constant = found.names.index("motor_constant")
    assert error[constant] <= 0.05 * values["motor_constant"]


def test_the_command_reads_the_log_of_a_robot(here, capsys):
    rng = np.random.default_rng(1)
    values = held_out(SERVO, "own", rng)
    (log,) = read(list(walks(ROBOT, ("middle",))), SERVO, "own", values, rng)
    targets, positions = (np.repeat(x[:, None], 6, axis=1) for x in (log.target, log.position))
    supply = np.full(len(log.time), 11.1)
    write_csv(here / "log.csv", ROBOT, log.time, targets, positions, voltage=supply)
    fixed = "compliance_margin,compliance_slope,punch,backlash,load_loss"
    arguments = ["identify", "log.csv", "--robot", "phantomx-ax", "--fix", fixed]
    assert main([*arguments, "--figure", "fit.svg", "--out", "servo.toml"]) == 0
    printed = capsys.readouterr().out
    assert "viscous_friction" in printed
    assert "hanging" not in printed
    assert (here / "fit.svg").stat().st_size > 100
    assert (here / "servo.toml").stat().st_size > 100


def test_a_leg_on_the_ground_is_refused(tmp_path, capsys):
    scenario = phasmid.load_scenario("paper").replace(robot="phantomx-ax", duration=2)
    path = tmp_path / "walk.nc"
    phasmid.save_recording(phasmid.simulate(scenario, phasmid.plan(scenario)), path)
    assert main(["identify", str(path), "--robot", "phantomx-ax"]) == 2
    assert "touches the ground" in capsys.readouterr().err


def test_logs_of_a_bench_and_a_leg_are_not_mixed():
    leg = next(walks(ROBOT))
    held = leg.target[:, 0]
    bench = BenchLog("b", leg.time, held, held, held < 9, Pendulum(0.3, 0.15), 12.0)
    with pytest.raises(InvalidInput, match="a fit each"):
        identify([bench, leg], SERVO)
