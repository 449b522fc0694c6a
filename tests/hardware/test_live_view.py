"""The live view of a robot on a bus."""

import json

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap_ros2")
pytest.importorskip("websockets")

from phasmid.hardware.live_view import serve_driver
from support.foxglove_client import FoxgloveClient
from support.hand_turned import until
from support.virtual_bus import FollowingPlant, new_driver, virtual_bus


def test_a_client_sees_the_measured_angles_and_its_velocity_is_followed(monkeypatch):
    with virtual_bus(monkeypatch, plant=FollowingPlant(18)) as (*robot, bus, _, clock):
        driver = new_driver(*robot, bus, velocity=(0.0, 0.0, 0.0))
        commanded, last = [], []
        twist = {"linear": {"x": 0.05, "y": 0.0}, "angular": {"z": 0.0}}
        with serve_driver(driver, port=0) as server:
            show, client = driver.watch, FoxgloveClient(server.address, ["/joint_states"])

            def watch(times, channels):
                show(times, channels)
                client.publish(json.dumps(twist))
                last[:] = times, channels
                commanded.append(tuple(channels["velocity_command"][0]))

            def is_connected():
                watch(*last)
                return server.velocity() is not None and client.received["/joint_states"]

            driver.watch = watch
            try:
                client.wait(lambda c: c.info is not None)
                client.advertise("/cmd_vel")
                # Virtual time stands still until both sides hear each other.
                clock.at(3.0, lambda: until(is_connected))
                driver.drive(1.0)
                _, message = client.received["/joint_states"][-1]
            finally:
                client.close()
    assert list(message.name[:2]) == ["right_front.coxa", "right_front.femur"]
    assert np.isfinite(message.position).all()
    assert (0.05, 0.0, 0.0) in commanded
