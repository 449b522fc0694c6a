"""Logs of a simulated bench or leg: known parameters, a coarse sensor and its noise."""

import math
from dataclasses import replace

import numpy as np

from phasmid import load_scenario, plan
from phasmid.identification import BenchLog, LegLog, Pendulum, simulate_logs
from phasmid.identification.parameters import servo_records, start_values
from phasmid.identification.simulation import STEP

NOISE = math.radians(0.1)
RATE = 100.0


def motions(time):
    """Name, goal [rad] and whether the torque is on, of each motion of the bench recipe."""
    on = np.ones(len(time), dtype=bool)
    yield "sweep", 0.9 * np.sin(0.9 * time**2), on
    yield "lift-and-drop", -math.pi / 2 * np.clip(time / 1.5, 0, 1), time < 2.2
    yield "slow", np.interp(time, [0, 3, 6], [0, 1.5, 1.2]), on
    yield "two-tones", 1.5 * np.sin(time) + 0.5 * np.sin(5 * time) * np.sin(2 * time), on
    steps = np.array([0, 0.75, 1.55, 0.75, -0.75, 0])
    yield "steps", steps[np.minimum(time.astype(int), 5)], on


def held_out(servo, model, rng):
    """Values that differ from the servo's table by up to a quarter."""
    values = start_values(servo, model, 0.0)
    for name in values:
        values[name] *= rng.uniform(0.75, 1.25)
    values |= {"hanging": math.radians(rng.uniform(-2, 2)), "delay": rng.uniform(0.008, 0.02)}
    values |= {"friction": rng.uniform(0.03, 0.07), "backlash": math.radians(rng.uniform(0.3, 0.8))}
    if "compliance_margin" in values:
        values["compliance_margin"] = float(rng.integers(0, 3))
    if "load_loss" in values:
        values["load_loss"] = rng.uniform(0.15, 0.4)
    if "stribeck_friction" in values:
        values |= {"stribeck_friction": 0.04, "stribeck_speed": 0.6, "stribeck_exponent": 1.2}
    return values


def synthetic_logs(servo, model, values, rng, names=(), mass=0.3):
    """Logs of 6 s in steps of the servo's sensor, of the named motions or of all."""
    time = np.arange(0.0, 6.0, 1 / RATE)
    start = np.full(len(time), values["hanging"])
    load = Pendulum(mass, 0.15, 0.02)
    logs = [
        BenchLog(name, time, goal, start, on, load, 12.0)
        for name, goal, on in motions(time)
        if not names or name in names
    ]
    return read(logs, servo, model, values, rng)


def walks(robot, names=()):
    """Joint targets of the robot's first leg in walks of 6 s, as logs that follow them exactly."""
    time = np.arange(0.0, 6.0, 1 / RATE)
    for name, period in (("slow", 2.0), ("middle", 1.0), ("fast", 0.7)):
        if not names or name in names:
            scenario = load_scenario("paper").replace(robot=robot, period=period, duration=6.0)
            target = plan(scenario).sample(time).q[:, 0]
            yield LegLog(name, time, target, target, robot.legs[0], 12.0)


def read(logs, servo, model, values, rng):
    """The logs with simulated angles, in steps of the servo's sensor."""
    parameters = servo_records(servo, model, values, [12.0] * len(logs), STEP)
    angles = simulate_logs(logs, parameters, values["delay"], values["hanging"])
    step = servo.resolution
    return [
        replace(log, position=np.round((one + rng.normal(0, NOISE, one.shape)) / step) * step)
        for log, one in zip(logs, angles, strict=True)
    ]


def write_csv(path, robot, time, target, position, **columns):
    """A log of a robot as CSV: targets in degrees, readings in radians, and further columns."""
    table = {"time_ms": 1000 * time, **columns}
    for leg, name in enumerate(robot.leg_names):
        for joint, word in enumerate(("coxa", "femur", "tibia")):
            table[f"{name}.{word}.target_deg"] = np.degrees(target[:, leg, joint])
            table[f"{name}.{word}.measured_rad"] = position[:, leg, joint]
    rows = zip(*table.values(), strict=True)
    lines = [",".join(table), *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]
    path.write_text("\n".join(lines).replace("nan", "") + "\n")
