"""What a refusal tells people to try is accepted when it is typed as it is printed."""

import re
import shutil
from importlib import resources
from pathlib import Path

import pytest

import phasmid
from phasmid.cli import main
from phasmid.cli.remedies import typed
from phasmid.formats import save_robot
from phasmid.robot import load_robot
from support.remedies import accept, answer, refusal, typed_back

LINES = """
walk --robot quadruped --gait trot
walk --robot quadruped --gait tripod
drive --robot octopod --gait crawl --velocity 0,0,0
gaits --gait trot --robot quadruped
export --out walk.h --robot quadruped --gait tripod
walk --step-length-mm 400
walk --step-length-mm 300 --step-turn-deg 40
walk --step-turn-deg 150 --step-length-mm 0
walk --step-length-mm 400 --period 0.2
walk --period 0.5 --drive servo --voltage 9
walk --drive servo --voltage 0.05
walk --body-height-mm 300
walk --step-height-mm 150 --step-length-mm 200
walk --robot quadruped --sway 0.45
walk --robot quadruped --sway 0 --step-length-mm -40
walk --gait wave --duty-factor 0.3
walk --duty-factor 1.4
walk --offsets 0,0.5,0,0.5,0,0.5
walk --stance-law coxa-only --step-length-mm 0 --step-sideways-mm 40
walk --terrain slope --slope-deg 20 --friction 0.2
walk --terrain rough --roughness-mm 100
walk --terrain stairs --period 0.8
walk --start-height-mm 50
walk --dt 0.5
walk --dt 0.0007 --record-interval 0.001
walk --dt 1e-12
walk --stiffness 1e9 --damping 1e6
walk --duration 1e9
walk --samples 1e9
walk --patches 0,1,2
walk --terrain ice --tile-mm 30
walk many.toml
walk rough.toml
walk --contact-law simscape --terrain stairs
walk --load-transfer 5
walk --name ../a
walk --edge-x-mm 300 400
walk --step-lenght-mm 40
walk --drive sevro
walk papper
walk long.toml
walk misplaced.toml
walk trot.toml
walk --robot blind.urdf
export --out cad --robot blind.urdf
drive --velocity 0.05,0
drive --velocity 0.05,0,0 --contact-law simscape
drive --velocity 0.05,0,0 --rate 0
drive --waypoints 1,0 --bus emulated
drive --velocity 0.05,0,0 --bus emulated --robot markwtech
bus emulate x
bus emulate --ids 1-x
bus emulate --model AX-12
bus emulate --robot lynxmotion-ch3r
advise --robot phantomx-ax --step-length-mm 400
check --robot phantomx-papre
check --robot swapped.toml
check --robot radians.toml
check --robot metres.toml
check --robot far.toml
check --robot turned.toml
walk --step-length-mm 5000
walk --terrain blocks --block-size-mm 1
export --robot phantomx-ax --out out.txt
check --robot phantomx-ax --servo-model AX-12A
export --out walk.h --terrain stairs
export --out walk.txt
export --out walk.h --step-length-mm 400
studio --robot quadruped --gait trot --no-open
check phantomx-ax
export phantomx-ax --out a.urdf
gaits tripod
report --list
advise --figure a.svg
export --out walk.h --channels stance
wlak
"""

PRESET = (resources.files("phasmid.robot") / "presets/phantomx-paper.toml").read_text("utf-8")


def preset(old: str, new: str) -> str:
    """The paper's robot with one line changed."""
    assert old in PRESET
    return PRESET.replace(old, new, 1)


FILES = {
    "swapped.toml": preset("coxa_deg = [-75, 75]", "coxa_deg = [75, -75]"),
    "radians.toml": preset("coxa_deg = [-75, 75]", "coxa = [-75, 75]"),
    "metres.toml": preset("femur_mm = 82", "femur = 82"),
    "far.toml": preset("mount_mm = [0, -103.4, 0]", "mount = [0, -103.4, 0]"),
    "turned.toml": preset("yaw_deg = -90", "yaw = -90"),
    "long.toml": "[stride]\nstep_length_mm = 400\n",
    "many.toml": f"[terrain]\npatches = {[[0, 1, 0, 1, 0.5]] * 1001}\n",
    "rough.toml": '[terrain]\nkind = "rough"\nroughness_mm = 100\n',
    "misplaced.toml": "step_length_mm = 40\n",
    "trot.toml": 'robot = "quadruped"\ngait = "trot"\n',
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with the files of the lines; meshes of a robot take long to write."""
    folder = tmp_path_factory.mktemp("files")
    for name, content in FILES.items():
        (folder / name).write_text(content)
    save_robot(load_robot("phantomx-ax"), folder / "blind.urdf")
    text = (folder / "blind.urdf").read_text()
    (folder / "blind.urdf").write_text(re.sub(' effort="[^"]*"', ' effort="0"', text))
    return folder


@pytest.fixture
def here(tmp_path, files, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    # A command that begins to work has accepted its input.
    for begin in (
        "phasmid.simulation.Run.record",
        "phasmid.hardware.driver.Driver.drive",
        "phasmid.hardware.Emulator.__enter__",
        "phasmid.studio.server.Server.__init__",
        "phasmid.control.engine.LocomotionEngine.largest_velocity",
    ):
        monkeypatch.setattr(begin, accept)
    return tmp_path


HINT = re.compile(r"""hint=\(?\s*f?("[^"\n]* = [^"\n]*"|'[^'\n]* = [^'\n]*')""")


def test_no_hint_of_the_source_fails_to_be_typed():
    """Those in braces are words here, and none may raise, whatever values are put there."""
    files = Path(phasmid.__file__).parent.rglob("*.py")
    hints = [found[1:-1] for file in files for found in HINT.findall(file.read_text("utf-8"))]
    assert len(hints) > 50
    for hint in hints:
        typed(hint, ["walk"])


@pytest.mark.parametrize(
    ("hint", "command", "remedy"),
    [
        ("patches = []", "walk", "--patches ''"),
        ("patches = [[0, 1, 0, 1, 0.2]]", "walk", "--patches 0,1,0,1,0.2"),
        (r'out = "results\study-2"', "study", r'out = "results\study-2"'),
        (r'out = "results\\study-2"', "study", r"--out 'results\study-2'"),
        (
            'out = "a-2", or force = true, which deletes',
            "study",
            "--out a-2, or --force, which deletes",
        ),
        ("force = false", "study", "force = false"),
        ('offsets = [0, 1], name = "a"', "walk", "--offsets 0,1 --name a"),
    ],
)
def test_values_are_typed_as_options_have_them(hint, command, remedy):
    """Lists, also empty ones; paths of Windows, quoted as TOML or not; and switches alone."""
    assert typed(hint, [command]) == remedy


def test_a_changed_study_is_accepted_in_another_folder_or_by_force(here, capsys, monkeypatch):
    """Its rows would be those of two studies."""
    table = 'kind = "plan"\nmetrics = ["energy.cost_of_transport"]\n[set]\nduration = 0.5\n'
    Path("s.toml").write_text(f"{table}[axes]\nstep_length_mm = [20]\n")
    command = ["study", "s.toml", "--out", "out", "--workers", "1", "--quiet"]
    assert answer(main, command) == 0
    monkeypatch.setattr("phasmid.studies.driver.LocalExecutor", accept)
    Path("s.toml").write_text(f"{table}[axes]\nstep_length_mm = [30]\n")
    assert answer(main, command) == 2
    refused = refusal(capsys.readouterr().err)
    again = typed_back(command, refused, here)
    assert again != command
    assert answer(main, again) == 0
    assert " or --force, which" in refused.remedy
    assert answer(main, [*command, "--force"]) == 0


@pytest.mark.parametrize("line", LINES.strip().splitlines())
def test_what_a_refusal_says_to_try_is_accepted(here, capsys, line):
    """Each is refused; the remedy, typed back, is not, and no remedy is in words alone."""
    arguments = line.split()
    assert answer(main, arguments) == 2
    refused = refusal(capsys.readouterr().err)
    again = typed_back(arguments, refused, here)
    status = answer(main, again)
    assert status == 0, (again, refusal(capsys.readouterr().err))
