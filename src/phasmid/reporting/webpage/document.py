"""A run's page: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any, TypeAlias

from phasmid.errors import plain
from phasmid.recording import Recording
from phasmid.reporting.run import Run, read_run
from phasmid.reporting.style import leg_colour
from phasmid.reporting.summary import Summary
from phasmid.reporting.text import facts, head, headline, leg_row, note
from phasmid.reporting.webpage.packing import data_url, json_block
from phasmid.reporting.webpage.replay import replay
from phasmid.robot import Appearance

LONGEST_FILE = 200_000
"""Most letters of a robot or scenario file that the page shows; the download is whole."""

DRAWING = (
    "algebra.js",
    "meshes.js",
    "drawing.js",
    "relief.js",
    "floor.js",
    "marks.js",
    "camera.js",
)
"""Scripts that draw a robot, in their order; the studio uses them too."""

VERSIONS = {
    "phasmid_version": "phasmid",
    "simulator": "Simulator",
    "mujoco_version": "MuJoCo",
    "numpy_version": "NumPy",
    "numba_version": "Numba",
    "machine": "Machine",
    "drive": "Drive",
    "contact_law": "Contact",
    "force_model": "Model's forces",
    "servo": "Servo",
    "time_step": "Time step [s]",
}
"""Attributes of a recording that the page shows, and their labels."""


Picture: TypeAlias = tuple[str, str, bytes]
"""Name of a figure, such as ``fig12``; its content in a sentence; the figure as SVG."""


def page_html(
    recording: Recording,
    summary: Summary,
    pictures: Sequence[Picture],
    still: bytes | None = None,
    appearance: Appearance | None = None,
) -> str:
    """Return a recording's page: replay, numbers, figures and data in one file without a network.

    Args:
        recording: A simulation, an analysis or a robot's log; it carries its robot and scenario.
        summary: Its `phasmid.reporting.summarise`.
        pictures: Its figures, in order.
        still: A PNG image of the robot, for print and for browsers that cannot show the replay.
        appearance: The robot's meshes; needed if the robot is not a preset of phasmid.

    Raises:
        InvalidInput: The recording does not carry the robot and the scenario.
    """
    run = read_run(recording, appearance)
    scene = replay(run) if run.can_be_drawn else None
    sections = [
        ("replay", "Replay", _player(run, scene, still)),
        ("summary", "Summary", _summary(summary)),
        ("figures", "Figures", _figures(pictures)),
        ("data", "Data, files and how to repeat it", _data(recording, summary, run)),
    ]
    sections = [section for section in sections if section[2]]
    links = "".join(f'<li><a href="#{name}">{heading}</a></li>' for name, heading, _ in sections)
    style = "".join(map(own_text, ("colours.css", "style.css")))
    script = "".join(map(own_text, (*DRAWING, "player.js")))
    title, version = headline(summary), run.attribute("phasmid_version")
    footer = f"Written by phasmid {version}".strip() + ". This file needs no network."
    return Template(own_text("template.html")).substitute(
        policy=content_policy(style, script),
        title=escape(f"{title} · phasmid"),
        style=style,
        script=script,
        kind="Report of a run" if summary["run"].get("kind") else "Report of a recording",
        headline=escape(title),
        links=f"<ul>{links}</ul>",
        sections="\n".join(
            f'<section id="{name}" aria-labelledby="{name}-title">'
            f'<h2 id="{name}-title">{heading}</h2>\n{content}\n</section>'
            for name, heading, content in sections
        ),
        footer=escape(footer),
        scene=json_block(scene),
    )


def own_text(name: str) -> str:
    """Return the text of a file of this package, such as ``colours.css``."""
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def content_policy(style: str, script: str) -> str:
    """Return the security policy of the page, which admits its own style and script alone."""
    return (
        f"default-src 'none'; img-src data:; style-src {_hash(style)}; "
        f"script-src {_hash(script)}; base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    """Return the hash by which the page's policy admits its own style and script."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"'sha256-{digest}'"


def _player(run: Run, scene: dict[str, Any] | None, still: bytes | None) -> str:
    """Return the replay: picture, controls, and a still for browsers that cannot play it."""
    if scene is None:
        return "<p>The robot's pose is not recorded: there is no replay.</p>"
    name, image = escape(plain(run.robot.name)), ""
    if still is not None:
        image = (
            f'<img class="still" alt="{name} in the middle of its walk, with the forces on its '
            f'feet" src="{data_url(still, "image/png")}">'
        )
    marks = {
        "forces": "foot forces" if "forces" in scene else "",
        "trails": "foot trails" if "feet" in scene else "",
        "support": "support polygon" if "margin" in scene else "",
        "centre": "centre of mass" if "centre" in scene else "",
        "names": "leg numbers",
        "follow": "follow the robot",
    }
    rows, load, arrows = "", "", ""
    if "margin" in scene:
        what = escape(f"Support margin of the {scene['margin_of']}")
        rows += f'<div><dt>{what}</dt><dd id="margin"></dd></div>'
    if "forces" in scene:
        what = escape(f"Feet bear, {scene['force_words']}")
        rows += f'<div><dt>{what}</dt><dd id="load-sum"></dd></div>'
        load = "<output data-load></output>"
        long = 1000 * scene["force_length"] * scene["span"]
        arrows = f"An arrow of {long:.0f} mm bears the whole weight. "
    return Template(own_text("player.html").rstrip()).substitute(
        name=name,
        still=image,
        boxes="".join(
            f'<label><input type="checkbox" id="show-{key}" checked>{words}</label>'
            for key, words in marks.items()
            if words
        ),
        readings=f'<dl class="now">{rows}</dl>' if rows else "",
        legs="".join(
            f"<li>{_chip(leg)}<span>{_leg(leg, name)}</span>{load}</li>"
            for leg, name in enumerate(run.robot.leg_names)
        ),
        arrows=arrows,
    )


def _leg(leg: int, name: str) -> str:
    """Return number and name of a leg, counted from 0."""
    return escape(f"{leg + 1} {plain(name).replace('_', ' ')}")


def _chip(leg: int) -> str:
    """Return a patch of a leg's colour: a drawing, as the page's policy allows no style of one."""
    return (
        '<svg class="chip" viewBox="0 0 8 8" aria-hidden="true">'
        f'<rect width="8" height="8" rx="2" fill="{leg_colour(leg)}"/></svg>'
    )


def _summary(summary: Summary) -> str:
    """Return the facts, the table and the warnings of the terminal as HTML."""
    rows = ""
    for label, fact in (*head(summary), *facts(summary)):
        # A line without a label continues the one before it.
        rows += f"<dt>{escape(label.replace('  ', '… '))}</dt>" if label else ""
        rows += f"<dd>{escape(fact)}</dd>"
    lines = []
    for leg, name in enumerate(summary["robot"]["legs"]):
        cells = "".join(f"<td>{escape(cell)}</td>" for cell in leg_row(summary, leg))
        lines.append(f'<tr><th scope="row">{_chip(leg)}{_leg(leg, name)}</th>{cells}</tr>')
    warnings = "".join(f"<li>{escape(plain(text))}</li>" for text in summary["warnings"])
    if warnings:
        warnings = f'<h3>Warnings</h3>\n<ul class="warnings">{warnings}</ul>'
    return Template(own_text("summary.html")).substitute(
        facts=rows,
        kinds="sim / model" if len(summary.get("normal_force", {})) == 2 else "mean",
        legs="".join(lines),
        note=escape(note(summary)),
        warnings=warnings,
    )


def _figures(pictures: Sequence[Picture]) -> str:
    cards = [
        f'<figure id="figure-{escape(name)}"><div class="card">'
        f'<img alt="{escape(plain(words))}" decoding="async" '
        f'src="{data_url(svg, "image/svg+xml")}"></div>'
        f"<figcaption><strong>{escape(name)}</strong> · {escape(plain(words))}"
        "</figcaption></figure>"
        for name, words, svg in pictures
    ]
    return f'<div class="figures">{"".join(cards)}</div>' if cards else ""


def _data(recording: Recording, summary: Summary, run: Run) -> str:
    links, shown = [], []
    for name in ("scenario", "robot"):
        text = str(recording.attrs[name])
        file = f"{name}.toml"
        address = data_url(text.encode(), "text/plain")
        links.append(f'<a href="{address}" download="{file}">{name.capitalize()} file</a>')
        cut = "\n".join(map(plain, text[:LONGEST_FILE].split("\n")))
        cut += "\n… (cut off here)" if len(text) > LONGEST_FILE else ""
        shown.append(f"<details><summary>{file}</summary><pre>{escape(cut)}</pre></details>")
    again = ""
    if "commands" in recording.attrs:
        again = "# Run it again, and compare bit by bit\nphasmid replay recording.nc\n"
    elif summary["run"].get("kind") in ("simulation", "model"):
        more = " --trajectory FILE" if summary["run"].get("follows") == "trajectory" else ""
        again = f"# Run it again\nphasmid walk scenario.toml{more} --out ../again\n"
    versions = "".join(
        f"<dt>{escape(label)}</dt><dd>{escape(run.attribute(name))}</dd>"
        for name, label in VERSIONS.items()
        if run.attribute(name)
    )
    return Template(own_text("data.html")).substitute(
        links="".join(f"<li>{link}</li>" for link in links),
        files="\n".join(shown),
        again=again,
        versions=versions,
    )
