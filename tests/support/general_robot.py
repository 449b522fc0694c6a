"""A robot without any symmetry."""

import numpy as np

from phasmid.robot import Body, Leg, Link, Robot, load_robot


def _random_inertia(rng, mass, size):
    # Second moments of a cloud of points, so that some rigid body has this inertia.
    points = rng.normal(size=(8, 3)) * size / 4
    spread = mass * points.T @ points / 8
    return np.trace(spread) * np.eye(3) - spread


def _random_link(rng, name):
    length, mass = rng.uniform(0.05, 0.2), rng.uniform(0.02, 0.3)
    com = rng.uniform(-0.4, 0.4, size=3) * length + [length / 2, 0.0, 0.0]
    inertia = _random_inertia(rng, mass, length)
    return Link(name, length, mass, com, inertia, 0.04 if name == "coxa" else 0.0)


def general_robot():
    """Five unlike legs on tilted hips with lateral offsets, every inertia full."""
    rng, tilt = np.random.default_rng(20180816), np.random.default_rng(20261121)
    legs = []
    for i in range(5):
        coxa, femur, tibia = (_random_link(rng, name) for name in ("coxa", "femur", "tibia"))
        legs.append(
            Leg(
                f"leg_{i}",
                coxa,
                femur,
                tibia,
                mount_position=rng.uniform(-0.2, 0.2, size=3),
                mount_yaw=rng.uniform(-np.pi, np.pi),
                neutral_foot=np.array([coxa.length + femur.length, 0.0, -tibia.length]),
                joint_limits=np.array([[-3.0, 3.0]] * 3),
                mount_pitch=tilt.uniform(-0.6, 0.6),
                mount_roll=tilt.uniform(-0.6, 0.6),
            )
        )
    body = Body(1.3, np.array([0.02, -0.03, 0.01]), _random_inertia(rng, 1.3, 0.3), np.full(3, 0.3))
    return Robot("general", body, tuple(legs), load_robot("phantomx-paper").servo)
