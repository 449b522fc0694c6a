"""Arrays and files as text within a page."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np

LARGEST = 32767
"""The largest number of 16 bits with sign."""

FORMS = {"i16": "<i2", "f32": "<f4", "u8": "u1", "u16": "<u2", "u32": "<u4"}
"""NumPy types of the kinds of packed arrays, little end first."""


def packed(values: np.ndarray, kind: str) -> dict[str, Any]:
    """Return an array as text that the player reads.

    Args:
        values: Any shape.
        kind: ``i16`` for numbers in steps of their largest over `LARGEST`; ``f32`` for single
            precision; ``u8``, ``u16`` and ``u32`` for whole numbers.

    Returns:
        ``kind``, ``shape``, ``step`` and ``data``, the numbers in base64, little end first.
    """
    step = 1.0
    if kind == "i16":
        largest = float(np.max(np.abs(values), initial=0.0))
        step = largest / LARGEST if largest > 0 else 1.0
        values = np.rint(values / step)
    data = base64.b64encode(values.astype(FORMS[kind]).tobytes()).decode()
    return {"kind": kind, "shape": list(values.shape), "step": step, "data": data}


def json_block(value: Any) -> str:
    """Return a value as JSON that is safe within a ``<script>`` of a page."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    # Only within texts do these letters occur, so that they may be written by their numbers.
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def data_url(content: bytes, kind: str) -> str:
    """Return a file's bytes as a data URL.

    Args:
        content: The bytes.
        kind: Media type, such as ``image/svg+xml``.
    """
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
