"""What browsers are told: the newest text of each kind, and sentences."""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Callable
from typing import Any

SAME_EVENT, MOST_SAID = 3.0, 256
"""A sentence is not told again for as long [s]; and so many of them are remembered."""

KINDS = ("catalogue", "scene", "setting", "state")
"""What a new browser must know, in the order in which it is told."""


class Telling:
    """Publishes what is new.

    Args:
        publish: Takes texts in JSON, and frames.
    """

    def __init__(self, publish: Callable[[str | bytes], None]) -> None:
        self.publish = publish
        self._texts: dict[str, str] = {}
        self._said: dict[str, float] = {}
        self._guard = threading.Lock()

    def hello(self) -> list[str]:
        """The newest text of each kind; any thread may ask."""
        with self._guard:
            return [self._texts[kind] for kind in KINDS if kind in self._texts]

    def tell(self, kind: str, value: Any) -> None:
        """Publish a text, and keep it for browsers to come; the same one only once."""
        text = json.dumps({kind: value}, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        if self._texts.get(kind) == text:
            return
        with self._guard:
            self._texts[kind] = text
        self.publish(text)

    def event(self, text: str, at: float, run: str = "") -> bool:
        """Publish a sentence; one that comes again and again is told now and then.

        Args:
            text: The sentence.
            at: Time of the robot [s].
            run: Id of the saved run that it is about.

        Returns:
            Whether it was told.
        """
        wall = time.monotonic()
        if wall - self._said.get(text, -math.inf) < SAME_EVENT:
            return False
        if len(self._said) >= MOST_SAID:
            self._said.clear()
        self._said[text] = wall
        event = {"time": round(at, 3), "text": text} | ({"run": run} if run else {})
        self.publish(json.dumps({"event": event}, ensure_ascii=False, separators=(",", ":")))
        return True
