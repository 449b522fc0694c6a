"""The live view of a robot on a bus."""

import time

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap_ros2")
pytest.importorskip("websockets")

from phasmid.hardware.live_view import serve_driver
from support.foxglove_client import FoxgloveClient
from support.virtual_bus import FollowingPlant, new_driver, virtual_bus


def is_subscribed(server):
    return "/joint_states" in server._channels and server._channels["/joint_states"].has_sinks()


def until(condition):
    end = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_client_sees_the_measured_angles_and_its_velocity_is_followed(monkeypatch):
    with virtual_bus(monkeypatch, plant=FollowingPlant(18)) as (*robot, bus, _, clock):
        driver = new_driver(*robot, bus, velocity=(0.0, 0.0, 0.0))
        commanded = []
        with serve_driver(driver, port=0) as server:
            show = driver.watch

            def watch(times, channels):
                show(times, channels)
                commanded.append(channels["velocity_command"][0])

            driver.watch = watch
            server._listener.command = np.inf, (0.05, 0.0, 0.0)
            client = FoxgloveClient(server.address, ["/joint_states"])
            try:
                # Virtual time stands still until the subscription is in force.
                clock.at(3.0, lambda: until(lambda: is_subscribed(server)))
                driver.drive(1.0)
                client.wait(lambda c: len(c.received["/joint_states"]) > 0)
                _, message = client.received["/joint_states"][-1]
            finally:
                client.close()
    assert list(message.name[:2]) == ["right_front.coxa", "right_front.femur"]
    assert np.isfinite(message.position).all()
    assert (0.05, 0.0, 0.0) in [tuple(row) for row in commanded]
