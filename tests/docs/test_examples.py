"""The examples and the Python code of README and pages run as they stand."""

import math
import re
import runpy
import warnings
from pathlib import Path

import pytest

from phasmid.control.script import load_script
from phasmid.motion import plan
from phasmid.robot import load_robot, robot_to_toml
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate
from phasmid.studies import load_study_file

ROOT = Path(__file__).parents[2]


def blocks(page, language):
    """Code blocks of a page, in order."""
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / page).read_text("utf-8"), re.DOTALL)


@pytest.fixture
def run(here):
    """Runs Python code as a program in an empty folder; warnings are errors."""

    def run_code(code):
        path = here / "program.py"
        path.write_text(code, encoding="utf-8")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            runpy.run_path(str(path), run_name="__main__")

    return run_code


SHORTER = {
    "09_with_and_without_dynamics": {
        "CYCLES = 1.0, 3": "CYCLES = 1.0, 1",
        'in ("phantomx-paper", "phantomx-mk4"):': 'in ("phantomx-mk4",):',
    }
}
"""What is replaced in an example that runs for long."""


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.stem)
def test_an_example_runs(path, run, capsys):
    code = path.read_text("utf-8")
    for old, new in SHORTER.get(path.stem, {}).items():
        assert old in code
        code = code.replace(old, new)
    run(code)
    assert capsys.readouterr().out


def test_the_readmes_python_code_runs(run, tmp_path):
    run(blocks("README.md", "python")[0])
    assert (tmp_path / "results/my-walk/figures/fig12.svg").exists()


APART = ("hardware", "studies")
"""Pages whose code needs a robot, or is run with fewer trials."""

WITH_CODE = {p.stem for p in (ROOT / "docs").glob("*.md") if "```python" in p.read_text("utf-8")}


@pytest.mark.parametrize("page", sorted(WITH_CODE.difference(APART)))
def test_the_python_code_of_a_page_runs(page, run):
    run("\n".join(blocks(f"docs/{page}.md", "python")))


def test_the_quadruped_crawls():
    scenario = load_scenario(ROOT / "examples/quadruped-crawl.toml")
    walk = plan(scenario)
    run = simulate(scenario, walk)
    assert run.attrs["ending"] == "COMPLETED"
    assert run.sizes["leg"] == 4
    asked = walk.trunk.position[-1, 0]
    assert float(run.body_position[-1, 0]) == pytest.approx(asked, rel=0.05)


def test_the_scenario_of_the_docs_is_one(tmp_path):
    text = blocks("docs/conventions.md", "toml")[0]
    (tmp_path / "my-walk.toml").write_text(text, encoding="utf-8")
    robot = robot_to_toml(load_robot("phantomx-ax"))
    (tmp_path / "my-robot.toml").write_text(robot, encoding="utf-8")
    scenario = load_scenario(tmp_path / "my-walk.toml")
    assert scenario.load_gait().duty_factor == 0.6
    assert scenario.load_robot().name == "phantomx-ax"


def test_the_study_of_the_docs_runs(tmp_path, run, capsys):
    text = blocks("docs/studies.md", "toml")[0]
    (tmp_path / "gaits.toml").write_text(text, encoding="utf-8")
    study, _ = load_study_file(tmp_path / "gaits.toml")
    example, _ = load_study_file(ROOT / "examples/studies/gaits.toml")
    assert study == example
    assert study.count() == 45
    text = text.replace("duration_s = 4", "duration_s = 0.1").replace("count = 5", "count = 1")
    text = text.replace("[1000, 1500, 2000]", "[1000, 1500]")
    (tmp_path / "gaits.toml").write_text(text, encoding="utf-8")
    run("\n".join(blocks("docs/studies.md", "python")).replace("workers=2", "workers=1"))
    assert "slip.mean" in capsys.readouterr().out


def test_the_files_of_commands_in_the_docs_are_read(tmp_path):
    page = (ROOT / "docs/conventions.md").read_text("utf-8")
    section = page.split("### Commands of a drive")[1].split("\n## ")[0]
    scripts = []
    for number, (ending, text) in enumerate(re.findall(r"```(\w+)\n(.*?)```", section, re.DOTALL)):
        path = tmp_path / f"commands-{number}.{ending}"
        path.write_text(text, encoding="utf-8")
        scripts.append(load_script(path))
    commands, waypoints = scripts
    assert commands.at(3).velocity == pytest.approx((0.05, 0.0, math.radians(10)))
    assert [place.x for place in waypoints.waypoint] == [0.3, 0.3]


PAGES = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]
PAGES += [str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs").glob("*.md"))]
PAGES += [str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs/course").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", (ROOT / page).read_text("utf-8")):
        assert ((ROOT / page).parent / link).exists(), link
