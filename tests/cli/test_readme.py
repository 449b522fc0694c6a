"""The README's commands, one after another in one folder."""

import importlib.util
import re
import shlex
from pathlib import Path

from cli.test_studio import Stage, interrupt
from phasmid.cli import main

README = (Path(__file__).parents[2] / "README.md").read_text("utf-8")


def commands(heading):
    """Arguments of each command in the first block below a heading."""
    section = README.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    blocks = re.findall(r"```\n(.*?)```", section, re.DOTALL)
    lines = [shlex.split(line, comments=True) for line in blocks[0].splitlines()]
    assert all(line[0] == "phasmid" for line in lines)
    return [line[1:] for line in lines]


def shortened(arguments):
    """The same command with a shorter run, or with one process."""
    if arguments[0] in ("walk", "drive") and "--help" not in arguments:
        return [*arguments, "--duration", "0.3", "--no-figures"]
    if arguments[0] == "study":
        return [*arguments, "--workers", "1"]
    return arguments


def test_no_command_of_the_readme_refuses_another(here, monkeypatch, capsys):
    monkeypatch.setattr("phasmid.studio.live_simulation.LiveSimulation", Stage)
    monkeypatch.setattr(Stage, "start", lambda self: interrupt())
    # What "make walk" writes, and the files that the reader brings.
    assert main(["walk", "--out", "results/paper", "--force", "--duration", "0.3"]) == 0
    assert main(["export", "--robot", "phantomx-paper", "--out", "robot.urdf"]) == 0
    assert main(["export", "results/paper", "--out", "my-angles.csv"]) == 0
    Path("my-study.toml").write_text(
        'kind = "plan"\nmetrics = ["energy.cost_of_transport"]\n'
        '[set]\nduration_s = 0.5\n[axes]\ngait = ["tripod", "wave"]\n'
    )
    for heading in ("Try another walk", "Bring your own robot", "Look at a walk"):
        for arguments in commands(heading):
            if arguments[-1] == "cad" and importlib.util.find_spec("build123d") is None:
                continue
            capsys.readouterr()
            try:
                status = main(shortened(arguments))
            except SystemExit as ended:
                status = ended.code
            # A shortened drive does not reach its waypoints, which is status 3.
            done = (0, 3) if "--waypoints" in arguments else (0,)
            assert status in done, (arguments, capsys.readouterr().err)
    # Each run is kept, and the name of its folder tells it from the others.
    folders = [path.parent.name for path in Path("results").glob("*/recording.nc")]
    # The reader gives no duration.
    runs = {name.replace("_duration-0.3", "") for name in folders}
    names = {"paper", "paper_gait-wave_step-length-mm-60", "turn", "octopod"}
    names |= {"paper_drive-servo_voltage-9", "paper_trajectory-my-angles", "paper_robot-robot"}
    names |= {"paper_drive_velocity-0.05_0_0.1", "paper_drive_waypoints-0.3_0_0.3_0.3"}
    assert names < runs
    walks = [line for line in commands("Try another walk") if line[0] in ("walk", "drive")]
    assert len(folders) == len(walks) - 1 + 2


def test_a_folder_that_is_taken_gets_the_next_number(here, capsys):
    walk = ["walk", "--duration", "0.1", "--no-figures"]
    Path("results").mkdir()
    Path("results/paper_duration-0.1-2.mcap").write_text("the log of a run that was cut off")
    names = []
    for _ in range(2):
        assert main(walk) == 0
        names.append(re.search("Written to results/([^/]*)/", capsys.readouterr().out)[1])
    assert names == ["paper_duration-0.1", "paper_duration-0.1-3"]
    assert main([*walk, "--force", "--quiet"]) == 0
    assert main([*walk, "--out", "results/paper_duration-0.1", "--quiet"]) == 2
    said = "exists; nothing was written.\n  try  --force, or another --out DIR\n"
    assert capsys.readouterr().err == f"phasmid: results/paper_duration-0.1 {said}"
    assert {path.name for path in Path("results").iterdir()} == {
        *names,
        "paper_duration-0.1-2.mcap",
    }
