"""Runs are served to a client of the Foxglove websocket protocol."""

import json
import socket
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from phasmid import load_recording, load_scenario, plan, replay, simulate
from phasmid.cli import main
from phasmid.control.script import CommandScript
from phasmid.errors import InvalidInput
from phasmid.kinematics import leg_frames
from phasmid.recording import save_mcap
from phasmid.recording.ros import definition
from phasmid.robot import load_robot
from phasmid.scenario.rerun import first_difference
from phasmid.simulation import new_drive, new_run

pytest.importorskip("foxglove")
pytest.importorskip("mcap_ros2")
pytest.importorskip("websockets")

from mcap_ros2._dynamic import generate_dynamic

from phasmid.live import serve
from phasmid.live import server as live_server
from phasmid.live.scene import Scene
from support.foxglove_client import FoxgloveClient, doubles, fields
from support.hand_turned import until

PAPER = load_scenario("paper").replace(duration=1.0)
TOPICS = ["/joint_states", "/tf", "/odom", "/feet/left_rear/force"]
ALL = [*TOPICS, "/links", "/scene"]


@pytest.fixture
def clock(monkeypatch):
    """A clock that runs only while the server waits."""
    fake = SimpleNamespace(now=100.0)

    def sleep(duration):
        fake.now += duration

    fake.perf_counter, fake.sleep = lambda: fake.now, sleep
    monkeypatch.setattr(live_server, "time", fake)
    return fake


@contextmanager
def connected(server, topics=()):
    client = FoxgloveClient(server.address, topics)
    try:
        yield client
    finally:
        client.close()


def until_all_arrive(client, server, run, clock):
    """Show the first state until every subscription is in force, and forget it."""

    def all_arrive():
        clock.now += 1 / 60
        server.show(np.zeros(1), run.channels(run.first))
        # The last of these states is received, too, before the run begins.
        time.sleep(0.01)
        return all(client.received.values())

    until(all_arrive)
    for received in client.received.values():
        received.clear()


def exported(recording, path):
    """Messages of the MCAP export, by topic and time [ns]."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    save_mcap(recording, path, rate=1e4)
    with path.open("rb") as file:
        found = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        return {(m[1].topic, m[2].log_time): m[3] for m in found}


def test_a_client_receives_the_messages_of_the_export_sixty_times_a_second(clock, tmp_path):
    run = new_run(PAPER, plan(PAPER))
    with serve(run, port=0) as server:
        begin = time.monotonic()
        with connected(server, ALL) as client:
            client.wait(lambda c: set(ALL) <= c.advertised.keys())
            assert time.monotonic() - begin < 1.0
            until_all_arrive(client, server, run, clock)
            # Longer than what is caught up: the first block, up to 15 ms, is due at once.
            clock.now += 1.0
            begun = clock.now
            recording = run.simulate()
            client.wait(lambda c: all(len(received) >= 60 for received in c.received.values()))
    assert clock.now - begun == pytest.approx(1.0 - 0.015, abs=1e-9)
    assert "clientPublish" not in client.info["capabilities"]
    wanted = exported(recording, tmp_path / "walk.mcap")
    assert {topic for topic, _ in wanted} == client.advertised.keys() - {"/links", "/scene"}
    for topic in TOPICS:
        # The first, one for each of 59 or 60 beginnings of a sixtieth of a second in 0.985 s, and
        # perhaps a late one from before.
        assert 60 <= len(client.received[topic]) <= 62, topic
        for ns, content in client.received[topic]:
            assert repr(content) == repr(wanted[topic, ns]), topic
    assert client.advertised["/joint_states"]["schemaName"] == "sensor_msgs/msg/JointState"
    ns, content = client.received["/joint_states"][-1]
    assert ns == pytest.approx(1e9, abs=1e9 / 60)
    row = recording.joint_position.sel(time=ns / 1e9, method="nearest")
    assert content.position == row.values.ravel().tolist()


@pytest.mark.parametrize("robot", ["phantomx-paper", "quadruped"])
def test_frames_and_arrows_are_those_of_the_robot(robot):
    model = load_robot(robot)
    random = np.random.default_rng(3)
    q = random.uniform(-1, 1, (len(model.legs), 3))
    sample = {"joint_position": q, "foot_position": random.uniform(-1, 1, (len(q), 3))}
    sample["foot_force"] = random.uniform(-9, 9, (len(q), 3))
    scene = Scene(model, PAPER.load_terrain())
    X = {"base_link": np.eye(4)}
    kind = scene.links.kind
    decode = generate_dynamic(kind, definition(kind))[kind]
    for stamped in decode(scene.links.encode(sample, 2_000_000_003)).transforms:
        stamp, moved = stamped.header.stamp, stamped.transform
        assert (stamp.sec, stamp.nanosec) == (2, 3)
        turn, p = moved.rotation, moved.translation
        X_parent_link = np.eye(4)
        X_parent_link[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        X_parent_link[:3, 3] = p.x, p.y, p.z
        X[stamped.child_frame_id] = X[stamped.header.frame_id] @ X_parent_link
    for number, leg in enumerate(model.legs):
        frames = leg.X_body_hip @ leg_frames(leg, q[number])
        for frame, wanted in zip(("coxa", "femur", "tibia", "foot"), frames, strict=True):
            # Products of four matrices of entries up to 1: some 1e-15.
            assert np.abs(X[f"{leg.name}.{frame}"] - wanted).max() < 1e-14
    (entity,) = fields(scene.forces(sample, 0))[2]
    for foot, force, message in zip(
        sample["foot_position"], sample["foot_force"], fields(entity)[7], strict=True
    ):
        arrow = fields(message)
        position, orientation = (fields(arrow[1][0])[number][0] for number in (1, 2))
        assert doubles(position, 3) == foot.tolist()
        ahead = Rotation.from_quat(doubles(orientation, 4)).apply([1.0, 0.0, 0.0])
        size = np.linalg.norm(force)
        assert np.abs(ahead - force / size).max() < 1e-14
        # The whole weight is 1.2 spans of the hips long.
        span = np.ptp(model.arrays.p_body_hip[:, :2], axis=0).max()
        length = arrow.get(2, [0.0])[0] + arrow[4][0]
        assert length == pytest.approx(1.2 * span * size / (9.81 * model.mass), rel=1e-12)


def test_a_watched_run_is_paced_and_equal_to_the_bit_whatever_its_clients_do():
    scenario = PAPER.replace(duration=0.5)
    walk = plan(scenario)
    run = new_run(scenario, walk)
    with serve(run, port=0) as server:
        host, port = server.address.removeprefix("ws://").split(":")
        with connected(server, ALL) as cut, connected(server, ALL) as staying:
            # A third client asks for a connection and never reads.
            with socket.create_connection((host, int(port))) as silent:
                silent.sendall(
                    f"GET / HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade"
                    "\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13"
                    "\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n".encode()
                )
                threading.Timer(0.2, cut.cut).start()
                begin = time.perf_counter()
                watched = run.simulate()
                elapsed = time.perf_counter() - begin
            assert staying.received["/joint_states"]
    # The first block of 16 ms is not waited for.
    assert elapsed > 0.5 - 0.017
    assert first_difference(simulate(scenario, walk), watched) is None


def script(ahead):
    return CommandScript.model_validate({"command": [{"time": 0, "ahead": ahead}]})


def test_a_clients_velocity_replaces_the_command_until_it_is_half_a_second_old(clock):
    scenario = PAPER.replace(drive="ideal-servo")
    run = new_drive(scenario, None, script(0.02))
    twist = {"linear": {"x": 0.04, "y": 0.01, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.1}}
    with serve(run, port=0) as server, connected(server) as client:
        client.wait(lambda c: c.info)
        assert "clientPublish" in client.info["capabilities"]
        client.advertise("/cmd_vel")
        nonsense = "", "[]", '{"linear": 3}', json.dumps(twist).replace("0.04", "NaN")
        for text in nonsense:
            client.publish(text)
        time.sleep(0.1)
        assert server.velocity() is None
        client.publish(json.dumps(twist))
        until(lambda: server.velocity() is not None)
        driven = run.simulate()
    commanded, own = (0.04, 0.01, 0.1), (0.02, 0.0, 0.0)
    command = driven.velocity_command
    # The first command is taken before the run is served. Time passes after each block of three
    # periods of 5 ms.
    assert (command.sel(time=slice(0.005, 0.48)) == commanded).all()
    assert (command.sel(time=slice(0.52, None)) == own).all()
    # The recording holds the commands that were followed.
    assert replay(driven).equal


def test_a_port_in_use_is_refused():
    run = new_run(PAPER, plan(PAPER))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with (
            pytest.raises(InvalidInput, match=f"port {port}: Address already in use"),
            serve(run, port=port),
        ):
            pass


def test_walk_prints_the_address(capsys, tmp_path):
    out = tmp_path / "walk"
    arguments = ["walk", "--duration", "0.1", "--live", "0", "--out", str(out), "--no-figures"]
    assert main(arguments) == 0
    assert "live at ws://localhost:" in capsys.readouterr().err
    assert load_recording(out / "recording.nc").sizes["time"] == 101
