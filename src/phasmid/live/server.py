"""Samples of a run out to Foxglove, and velocity commands in, through a websocket server."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import foxglove
import numpy as np
from foxglove.messages import SceneUpdate
from foxglove.websocket import Capability, ChannelView, Client, ClientChannel, ServerListener

from phasmid.errors import InvalidInput, plain
from phasmid.live.scene import Scene
from phasmid.recording.ros import Topic, definition, topics
from phasmid.robot import Robot
from phasmid.simulation import Run
from phasmid.simulation.closed_loop import ClosedLoopRun
from phasmid.terrain import Ground

HOST, PORT = "127.0.0.1", 8765
"""Where the server listens: this machine only, on Foxglove's usual port."""

RATE = 60.0
"""Most messages of a topic a second of real time [1/s]."""

COMMAND_TOPIC = "/cmd_vel"
"""Topic of velocity commands: ``linear.x``, ``linear.y`` [m/s], ``angular.z`` [rad/s] as JSON."""

DEAD_MAN_TIME = 0.5
"""Real time after which a velocity command is no longer followed [s]."""

MOST_BEHIND = 0.1
"""Longest delay that is caught up; the rest of a longer one is dropped [s]."""

LINKS, SCENE = "/links", "/scene"
"""Topics of the links' frames and of the scene, beside those of `phasmid.recording.save_mcap`."""


class LiveServer:
    """Server of one robot's state for Foxglove.

    `serve` connects it to a simulated run. Others call `show` with each new sample and follow
    `velocity` where it is not None.

    Args:
        robot: The robot.
        ground: Its ground.
        steered: Whether clients may send velocity commands.
        host: Name or address of the interface on which it listens.
        port: 0 for any free one.
        pace: Simulated seconds per second above which `show` waits; infinite: never.

    Attributes:
        address: Address for Foxglove.

    Raises:
        InvalidInput: It cannot listen there.
    """

    def __init__(
        self,
        robot: Robot,
        ground: Ground,
        *,
        steered: bool = True,
        host: str = HOST,
        port: int = PORT,
        pace: float = 1.0,
    ) -> None:
        self._names, self._pace = robot.leg_names, pace
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._topics: dict[str, Topic] = {}
        self._listener = _Listener()
        try:
            self._server = foxglove.start_server(
                name=f"phasmid: {robot.name}",
                host=host,
                port=port,
                capabilities=[Capability.Time, *[Capability.ClientPublish] * steered],
                supported_encodings=["json"] * steered,
                server_listener=self._listener,
                context=self._context,
            )
        except RuntimeError as error:
            reason = str(error).rpartition(": ")[2]
            raise InvalidInput(
                f"cannot listen on {plain(host)}, port {port}: {reason}.",
                hint="--live 0, which takes a free port",
            ) from None
        name = "localhost" if host == HOST else f"[{host}]" if ":" in host else host
        self.address = f"ws://{name}:{self._server.port}"
        self._scene = Scene(robot, ground)
        self._channels[SCENE] = self._channel(SCENE, SceneUpdate.get_schema(), "protobuf")
        self._begin, self._tick = -math.inf, -1

    def close(self) -> None:
        """Disconnect all clients and stop listening."""
        self._server.stop()

    def velocity(self) -> tuple[float, float, float] | None:
        """Return the velocity that a client commands now, or None.

        It is forward, left [m/s] and yaw rate [rad/s], as in `phasmid.experiment.Command`.
        """
        arrival, velocity = self._listener.command
        return velocity if time.perf_counter() - arrival < DEAD_MAN_TIME else None

    def show(self, times: np.ndarray, channels: Mapping[str, np.ndarray]) -> None:
        """Wait until the last sample is due, and publish the topics that clients subscribed to.

        A slow client does not delay the run; it loses the oldest messages. At most `RATE` samples a
        second are published.

        Args:
            times: Times of new samples [s], shape (N,).
            channels: Channels of a recording at these times. Those of the first call define the
                topics.
        """
        now, wait = time.perf_counter(), float(times[-1]) / self._pace
        # The first sample is due at once.
        if now - (self._begin + wait) > MOST_BEHIND:
            self._begin = now - wait
        time.sleep(max(0.0, self._begin + wait - now))
        tick = math.floor(time.perf_counter() * RATE)
        if tick != self._tick:
            self._tick = tick
            self._publish(
                round(1e9 * float(times[-1])), {name: each[-1] for name, each in channels.items()}
            )

    def _publish(self, ns: int, sample: Mapping[str, np.ndarray]) -> None:
        """Publish a sample on the topics that are subscribed."""
        if not self._topics:
            self._topics = topics(sample, self._names) | {LINKS: self._scene.links}
            for name, topic in self._topics.items():
                text = definition(topic.kind).encode()
                schema = foxglove.Schema(name=topic.kind, encoding="ros2msg", data=text)
                self._channels[name] = self._channel(name, schema, "cdr")
        wanted = [name for name, channel in self._channels.items() if channel.has_sinks()]
        if wanted:
            self._server.broadcast_time(ns)
        for name in wanted:
            channel = self._channels[name]
            if name != SCENE:
                channel.log(self._topics[name].encode(sample, ns), log_time=ns)
                continue
            if self._scene.follow(sample) or self._listener.has_new_viewer:
                self._listener.has_new_viewer = False
                channel.log(self._scene.still, log_time=ns)
            channel.log(self._scene.forces(sample, ns), log_time=ns)

    def _channel(self, name: str, schema: foxglove.Schema, encoding: str) -> foxglove.Channel:
        return foxglove.Channel(
            name, schema=schema, message_encoding=encoding, context=self._context
        )


class _Listener(ServerListener):
    """Events of clients, in a thread of the server.

    Attributes:
        command: Arrival [s] and velocity of the newest command.
        has_new_viewer: Whether a client has subscribed to the scene and not received its meshes.
    """

    def __init__(self) -> None:
        self.command: tuple[float, tuple[float, float, float]] = -math.inf, (0.0, 0.0, 0.0)
        self.has_new_viewer = False
        self._topics: dict[tuple[int, int], str] = {}

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        del client
        if channel.topic == SCENE:
            self.has_new_viewer = True

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        self._topics[client.id, channel.id] = channel.topic

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        self._topics.pop((client.id, client_channel_id), None)

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        if self._topics.get((client.id, client_channel_id)) != COMMAND_TOPIC:
            return
        try:
            twist = json.loads(data)
            linear, turn = twist["linear"], float(twist["angular"]["z"])
            velocity = float(linear["x"]), float(linear["y"]), turn
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if all(map(math.isfinite, velocity)):
            self.command = time.perf_counter(), velocity


@contextmanager
def serve(
    run: Run, *, host: str = HOST, port: int = PORT, pace: float = 1.0
) -> Iterator[LiveServer]:
    """Serve a run to Foxglove until the context ends; the run waits for real time.

    Velocity commands of clients replace those of a closed-loop run while they arrive.

    Args:
        run: The run, before its first step.
        host: Name or address of the interface on which the server listens.
        port: 0 for any free one.
        pace: Most simulated seconds per second.

    Raises:
        InvalidInput: The server cannot listen there.
        InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
    """
    steered = isinstance(run, ClosedLoopRun)
    server = LiveServer(run.robot, run.ground, steered=steered, host=host, port=port, pace=pace)
    run.watch(server.show, pace / RATE)
    # Advertise the topics before the run begins.
    server.show(np.array([run.step * run.dt]), run.channels(run.first))
    if isinstance(run, ClosedLoopRun):
        run.override = server.velocity
    try:
        yield server
    finally:
        server.close()
