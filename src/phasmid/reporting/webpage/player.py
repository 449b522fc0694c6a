"""The replay in a page: picture, controls, and a still for browsers that cannot play it."""

from __future__ import annotations

from html import escape
from typing import Any

from phasmid.errors import plain
from phasmid.reporting.source import Source
from phasmid.reporting.style import leg_colour
from phasmid.reporting.webpage.packing import data_url

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)

VIEWS = {
    "corner": "front corner",
    "side": "side",
    "front": "front",
    "behind": "behind",
    "above": "above",
}
"""Views of the player, and their labels."""


def player(source: Source, scene: dict[str, Any] | None, still: bytes | None) -> str:
    """Return the replay as HTML.

    Args:
        source: Robot and experiment.
        scene: The scene of `phasmid.reporting.webpage.replay.replay`, or None.
        still: A ``.png`` of the robot.
    """
    if scene is None:
        return "<p>The robot's pose is not recorded: there is no replay.</p>"
    name = escape(plain(source.robot.name))
    image = (
        f'<img class="still" alt="{name} in the middle of its walk, with the forces on its feet" '
        f'src="{data_url(still, "image/png")}">'
        if still is not None
        else ""
    )
    return (
        '<div class="stage"><canvas id="view" tabindex="0" role="img" aria-label="Moving picture '
        f'of {name}; the controls below play it"></canvas>{image}</div>\n'
        '<p class="note unplayed">The replay needs scripts and WebGL 2; '
        "all else on this page does not.</p>\n"
        f'<div class="player">{_controls(scene)}{_readings(scene)}{_legs(source, scene)}'
        f'<p class="note">{_hint(scene)}</p></div>'
    )


def _controls(scene: dict[str, Any]) -> str:
    speeds = "".join(
        f'<option value="{speed:g}"{" selected" if speed == 1 else ""}>{speed:g}×</option>'
        for speed in SPEEDS
    )
    views = "".join(f'<option value="{key}">{words}</option>' for key, words in VIEWS.items())
    marks = {
        "forces": "foot forces" if "forces" in scene else "",
        "trails": "foot trails" if "feet" in scene else "",
        "support": "support polygon" if "margin" in scene else "",
        "centre": "centre of mass" if "centre" in scene else "",
        "names": "leg numbers",
        "follow": "follow the robot",
    }
    boxes = "".join(
        f'<label><input type="checkbox" id="show-{key}" checked>{words}</label>'
        for key, words in marks.items()
        if words
    )
    return (
        '<div class="controls"><button type="button" id="play" aria-pressed="false">Play</button>'
        '<button type="button" id="back" aria-label="One frame back">−1</button>'
        '<button type="button" id="on" aria-label="One frame on">+1</button>'
        '<div class="seek"><label class="hidden" for="seek">Time</label>'
        '<input type="range" id="seek" min="0" max="1" step="any" value="0">'
        '<output id="clock" for="seek"></output></div></div>'
        f'<div class="controls"><label>Speed <select id="speed">{speeds}</select></label>'
        f'<label>From <select id="view-from">{views}</select></label>{boxes}</div>'
    )


def _readings(scene: dict[str, Any]) -> str:
    rows = ""
    if "margin" in scene:
        what = escape(f"Support margin of the {scene['margin_of']}")
        rows += f'<div><dt>{what}</dt><dd id="margin"></dd></div>'
    if "forces" in scene:
        what = escape(f"Feet bear, {scene['force_words']}")
        rows += f'<div><dt>{what}</dt><dd id="load-sum"></dd></div>'
    return f'<dl class="now">{rows}</dl>' if rows else ""


def _legs(source: Source, scene: dict[str, Any]) -> str:
    load = "<output data-load></output>" if "forces" in scene else ""
    items = "".join(
        f"<li>{chip(leg)}<span>{leg + 1} {escape(plain(name).replace('_', ' '))}</span>{load}</li>"
        for leg, name in enumerate(source.robot.leg_names)
    )
    return f'<ul class="legs" aria-label="Legs and the forces on their feet">{items}</ul>'


def _hint(scene: dict[str, Any]) -> str:
    long = 1000 * scene["force_length"] * scene["span"]
    arrows = f"An arrow of {long:.0f} mm bears the whole weight. " if "forces" in scene else ""
    return (
        f"{arrows}Grid 100 mm. Drag to turn; <kbd>+</kbd> <kbd>−</kbd> or two fingers to zoom; "
        "<kbd>Space</kbd> plays, <kbd>←</kbd> <kbd>→</kbd> step, with <kbd>Shift</kbd> by a second."
    )


def chip(leg: int) -> str:
    """Return a patch of a leg's colour as SVG: the page's policy forbids inline styles.

    Args:
        leg: Counted from 0.
    """
    colour = leg_colour(leg)
    return (
        '<svg class="chip" viewBox="0 0 8 8" aria-hidden="true">'
        f'<rect width="8" height="8" rx="2" fill="{colour}"/></svg>'
    )
