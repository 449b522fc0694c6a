"""Live view of a robot on a servo bus in Foxglove (extra ``live``)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from phasmid.hardware.driver import Driver
from phasmid.kinematics import body_from_hip, foot_position
from phasmid.live import HOST, PORT, LiveServer
from phasmid.terrain import Flat, Ground


@contextmanager
def serve_driver(driver: Driver, *, host: str = HOST, port: int = PORT) -> Iterator[LiveServer]:
    """Serve a robot on a servo bus to Foxglove until the context ends.

    Its body is shown level at its starting place, on its lowest foot: servos measure no place.
    Velocity commands of clients replace those of the drive while they arrive.

    Args:
        driver: The driver, before its drive.
        host: Name or address of the interface on which the server listens.
        port: 0 for any free one.

    Raises:
        InvalidInput: The server cannot listen there.
    """
    robot = driver.robot.robot
    server = LiveServer(robot, Ground(Flat(), 0.7), host=host, port=port, pace=math.inf)

    def show(times: np.ndarray, channels: Mapping[str, np.ndarray]) -> None:
        q = channels["joint_position_measured"]
        feet = body_from_hip(robot, foot_position(robot.arrays, q))
        place = np.zeros((len(q), 3))
        place[:, 2] = -feet[..., 2].min(axis=1)
        level = np.tile([1.0, 0.0, 0.0, 0.0], (len(q), 1))
        shown = {"joint_position": q, "body_position": place, "body_orientation": level}
        server.show(times, {**channels, **shown})

    # Clients miss topics that are advertised later.
    angles = np.zeros((1, len(robot.legs), 3))
    names = "joint_position_measured", "joint_position_target", "joint_velocity_target"
    show(np.zeros(1), dict.fromkeys(names, angles))
    driver.watch, driver.override = show, server.velocity
    try:
        yield server
    finally:
        server.close()
