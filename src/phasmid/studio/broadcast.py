"""Texts for the browsers: the newest of each kind, and events."""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Callable
from typing import Any

SAME_EVENT = 3.0
"""Least time between two events with the same text [s]."""

MOST_REMEMBERED = 256
"""Most texts of events that are remembered."""

KINDS = ("catalogue", "scene", "setting", "state")
"""Kinds of texts that a new browser needs, in order."""


class Broadcast:
    """Publisher of new messages.

    Args:
        publish: Takes texts in JSON, and frames.
    """

    def __init__(self, publish: Callable[[str | bytes], None]) -> None:
        self.publish = publish
        self._texts: dict[str, str] = {}
        self._events: dict[str, float] = {}
        self._lock = threading.Lock()

    def hello(self) -> list[str]:
        """Return the newest text of each kind; any thread may call it."""
        with self._lock:
            return [self._texts[kind] for kind in KINDS if kind in self._texts]

    def set(self, kind: str, value: Any) -> None:
        """Publish a text if it is new, and keep it for browsers to come."""
        text = _json({kind: value})
        if self._texts.get(kind) == text:
            return
        with self._lock:
            self._texts[kind] = text
        self.publish(text)

    def event(self, text: str, at: float, run: str = "") -> bool:
        """Publish an event; one that repeats is published now and then.

        Args:
            text: Sentence.
            at: Simulated time [s].
            run: Id of the saved run that it is about.

        Returns:
            True if it was published.
        """
        wall = time.monotonic()
        if wall - self._events.get(text, -math.inf) < SAME_EVENT:
            return False
        if len(self._events) >= MOST_REMEMBERED:
            self._events.clear()
        self._events[text] = wall
        event = {"time": round(at, 3), "text": text} | ({"run": run} if run else {})
        self.publish(_json({"event": event}))
        return True


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
