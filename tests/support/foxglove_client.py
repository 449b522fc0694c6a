"""A client of the Foxglove websocket protocol, written from its specification.

https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
"""

import contextlib
import json
import socket
import struct
import threading

from mcap_ros2._dynamic import generate_dynamic
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect


class FoxgloveClient:
    """Subscribes to topics and keeps their messages as (time [ns], content)."""

    def __init__(self, address, topics):
        self.topics, self.received = set(topics), {topic: [] for topic in topics}
        self.info, self.advertised, self.times = None, {}, []
        self._subscribed, self._ready = {}, threading.Condition()
        connection = connect(address, subprotocols=["foxglove.sdk.v1"], max_size=None)
        self._stack = contextlib.ExitStack()
        self._socket = self._stack.enter_context(connection)
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()

    def _receive(self):
        with contextlib.suppress(ConnectionClosed):
            for message in self._socket:
                with self._ready:
                    self._take(message)
                    self._ready.notify_all()

    def _take(self, message):
        if isinstance(message, str):
            content = json.loads(message)
            if content["op"] == "serverInfo":
                self.info = content
            elif content["op"] == "advertise":
                for channel in content["channels"]:
                    self._take_channel(channel)
        elif message[0] == 1:
            number, ns = struct.unpack_from("<IQ", message, 1)
            topic, decode = self._subscribed[number]
            self.received[topic].append((ns, decode(message[13:])))
        elif message[0] == 2:
            self.times.append(struct.unpack_from("<Q", message, 1)[0])

    def _take_channel(self, channel):
        topic = channel["topic"]
        self.advertised[topic] = channel
        if topic in self.topics:
            decode = bytes
            if channel["encoding"] == "cdr":
                kind = channel["schemaName"]
                decode = generate_dynamic(kind, channel["schema"])[kind]
            number = len(self._subscribed)
            self._subscribed[number] = topic, decode
            subscription = {"id": number, "channelId": channel["id"]}
            self._send({"op": "subscribe", "subscriptions": [subscription]})

    def wait(self, condition, timeout=20.0):
        """Wait until a condition of this client holds."""
        with self._ready:
            assert self._ready.wait_for(lambda: condition(self), timeout)

    def advertise(self, topic):
        channel = {"id": 7, "topic": topic, "encoding": "json", "schemaName": "geometry_msgs/Twist"}
        self._send({"op": "advertise", "channels": [channel]})

    def publish(self, text):
        self._socket.send(struct.pack("<BI", 1, 7) + text.encode())

    def _send(self, content):
        self._socket.send(json.dumps(content))

    def cut(self):
        """Drop the connection without a farewell."""
        self._socket.socket.shutdown(socket.SHUT_RDWR)

    def close(self):
        self._stack.close()
        self._thread.join(10.0)


def fields(message):
    """Return the fields of a protobuf message as lists by their numbers; absent ones are zero."""
    found, at = {}, 0

    def varint():
        nonlocal at
        value = shift = 0
        while True:
            byte = message[at]
            value, shift, at = value | (byte & 127) << shift, shift + 7, at + 1
            if byte < 128:
                return value

    while at < len(message):
        number, wire = divmod(varint(), 8)
        if wire == 0:
            value = varint()
        elif wire == 1:
            (value,), at = struct.unpack_from("<d", message, at), at + 8
        else:
            length = varint()
            value, at = message[at : at + length], at + length
        found.setdefault(number, []).append(value)
    return found


def doubles(message, count):
    """Return the first fields of a protobuf message of doubles."""
    found = fields(message)
    return [found.get(number, [0.0])[0] for number in range(1, count + 1)]
