"""A run's page: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from phasmid.errors import plain
from phasmid.recording import Recording
from phasmid.reporting.drawing import can_be_drawn
from phasmid.reporting.source import Source, attribute, finite_part, read_source
from phasmid.reporting.summary import Summary
from phasmid.reporting.text import facts, head, headline, leg_row, note
from phasmid.reporting.webpage.packing import compressed, data_url, json_block
from phasmid.reporting.webpage.player import chip, player
from phasmid.reporting.webpage.replay import replay
from phasmid.reporting.webpage.table import data_table
from phasmid.reporting.webpage.words import VERSIONS, Claim, claims, repeat, sentence
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


@dataclass(frozen=True)
class Picture:
    """A figure in a page.

    Attributes:
        name: Name of the figure and its file, such as ``fig12``.
        words: Its content, in a sentence.
        svg: The figure.
    """

    name: str
    words: str
    svg: bytes


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
        still: A ``.png`` of the robot, for paper and for browsers that do not play.
        appearance: The robot's meshes, where they do not come with phasmid.

    Raises:
        InvalidInput: The recording does not carry the robot and the scenario.
    """
    source = read_source(recording, appearance)
    scene = replay(finite_part(recording), source) if can_be_drawn(recording) else None
    sections = [
        ("replay", "Replay", player(source, scene, still)),
        ("summary", "Summary", _summary(summary)),
        ("claims", "Claims and warnings", _claims(list(claims(summary)), summary)),
        ("figures", "Figures", _figures(pictures)),
        ("data", "Data, files and how to repeat it", _data(recording, summary, source)),
    ]
    sections = [section for section in sections if section[2]]
    links = "".join(f'<li><a href="#{name}">{title}</a></li>' for name, title, _ in sections)
    style = "".join(map(own_text, ("colours.css", "style.css")))
    script = "".join(map(own_text, (*DRAWING, "player.js")))
    policy = (
        f"default-src 'none'; img-src data:; style-src {_hash(style)}; "
        f"script-src {_hash(script)}; base-uri 'none'; form-action 'none'"
    )
    words, version = headline(summary), attribute(recording, "phasmid_version")
    footer = f"Written by phasmid {version}".strip() + ". This file needs no network."
    return Template(own_text("template.html")).substitute(
        policy=policy,
        title=escape(f"{words} · phasmid"),
        style=style,
        script=script,
        kind="Report of a run" if summary["run"].get("kind") else "Report of a recording",
        headline=escape(words),
        sentence=escape(sentence(summary, source)),
        links=f"<ul>{links}</ul>",
        sections="\n".join(
            f'<section id="{name}" aria-labelledby="{name}-title">'
            f'<h2 id="{name}-title">{title}</h2>\n{content}\n</section>'
            for name, title, content in sections
        ),
        footer=escape(footer),
        scene=json_block(scene),
    )


def own_text(name: str) -> str:
    """Return the text of a file of this package, such as ``colours.css``."""
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    """Return the hash by which the page's policy admits its own style and script."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"'sha256-{digest}'"


def _summary(summary: Summary) -> str:
    """Return the facts and the table of the terminal as HTML."""
    rows = ""
    for label, fact in (*head(summary), *facts(summary)):
        # A line without a label continues the one before it.
        rows += f"<dt>{escape(label.replace('  ', '… '))}</dt>" if label else ""
        rows += f"<dd>{escape(fact)}</dd>"
    both = len(summary.get("normal_force", {})) == 2
    force = "Normal force [N]<br>sim / model" if both else "Normal force [N]<br>mean"
    heads = [force, "Slip [mm]<br>&nbsp;"]
    heads += [f"{joint} [N·m]<br>peak / rms" for joint in ("Coxa", "Femur", "Tibia")]
    lines = []
    for leg, name in enumerate(summary["robot"]["legs"]):
        label, *cells = leg_row(summary, leg, f"{leg + 1} {plain(name).replace('_', ' ')}")
        numbers = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
        lines.append(f'<tr><th scope="row">{chip(leg)}{escape(label)}</th>{numbers}</tr>')
    table = (
        '<div class="scrolls" tabindex="0" role="region" aria-label="Numbers of each leg">'
        '<table class="numbers"><thead><tr><th scope="col">Leg</th>'
        + "".join(f'<th scope="col">{title}</th>' for title in heads)
        + f"</tr></thead><tbody>{''.join(lines)}</tbody></table></div>"
    )
    words = f'<p class="note">{escape(note(summary))}</p>'
    return f'<dl class="facts">{rows}</dl>\n<h3>Leg by leg</h3>\n{table}\n{words}'


def _claims(found: list[Claim], summary: Summary) -> str:
    lines = []
    for claim in found:
        verdict = ("holds", "holds") if claim.holds else ("fails", "does not hold")
        lines.append(
            f'<tr><th scope="row">{escape(claim.what)}</th>'
            f'<td><span class="verdict {verdict[0]}">{verdict[1]}</span></td>'
            f"<td>{escape(plain(claim.found))}</td><td>{escape(claim.limit)}</td></tr>"
        )
    table = (
        '<div class="scrolls" tabindex="0" role="region" aria-label="Claims"><table><thead><tr>'
        '<th scope="col">Claim</th><th scope="col">Verdict</th><th scope="col">Found</th>'
        f'<th scope="col">Limit</th></tr></thead><tbody>{"".join(lines)}</tbody></table></div>'
    )
    warnings = [escape(plain(text)) for text in summary.get("warnings", ())]
    words = "".join(f"<li>{text}</li>" for text in warnings)
    listed = f'<ul class="warnings">{words}</ul>' if words else "<p>There is none.</p>"
    return f"{table if found else ''}\n<h3>Warnings</h3>\n{listed}"


def _figures(pictures: Sequence[Picture]) -> str:
    cards = [
        f'<figure id="figure-{escape(picture.name)}"><div class="card">'
        f'<img alt="{escape(plain(picture.words))}" decoding="async" '
        f'src="{data_url(picture.svg, "image/svg+xml")}"></div>'
        f"<figcaption><strong>{escape(picture.name)}</strong> · {escape(plain(picture.words))}"
        "</figcaption></figure>"
        for picture in pictures
    ]
    return f'<div class="figures">{"".join(cards)}</div>' if cards else ""


def _data(recording: Recording, summary: Summary, source: Source) -> str:
    csv, rate = data_table(recording, source)
    links = [_download("data.csv.gz", "Data as CSV", compressed(csv), "application/gzip", "csv")]
    shown = []
    for name in ("scenario", "robot"):
        text = str(recording.attrs[name])
        file = f"{name}.toml"
        links.append(_download(file, f"{name.capitalize()} file", text.encode(), "text/plain"))
        cut = "\n".join(map(plain, text[:LONGEST_FILE].split("\n")))
        cut += "\n… (cut off here)" if len(text) > LONGEST_FILE else ""
        shown.append(f"<details><summary>{file}</summary><pre>{escape(cut)}</pre></details>")
    commands = "\n".join(f"# {what}\n{command}" for what, command in repeat(summary))
    versions = _rows((title, attribute(recording, name)) for name, title in VERSIONS.items())
    return (
        f'<ul class="files">{"".join(f"<li>{link}</li>" for link in links)}</ul>\n'
        f'<p class="note">The table has {rate:.3g} rows a second of {summary["run"]["samples"]} '
        "samples, with six digits; <code>recording.nc</code>, beside this page, has all.</p>\n"
        f"<h3>Files of the run</h3>\n{''.join(shown)}\n"
        f"<h3>How to repeat it</h3>\n<p>In the folder of the run:</p>\n"
        f"<pre>{escape(commands)}</pre>\n"
        f'<h3>Versions and settings</h3>\n<dl class="facts">{versions}</dl>'
    )


def _download(file: str, words: str, content: bytes, kind: str, name: str = "") -> str:
    own = f' id="{name}"' if name else ""
    return f'<a{own} href="{data_url(content, kind)}" download="{file}">{words}</a>'


def _rows(pairs: Iterable[tuple[str, Any]]) -> str:
    return "".join(
        f"<dt>{escape(label)}</dt><dd>{escape(str(value))}</dd>" for label, value in pairs if value
    )
