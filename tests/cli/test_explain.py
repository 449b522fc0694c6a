"""``phasmid explain``: its answers, pictures and refusals."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from phasmid.cli import main
from phasmid.kinematics import foot_position
from phasmid.robot import load_robot

pytestmark = pytest.mark.usefixtures("compiled_engine")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def explained(capsys, *arguments):
    """Status and output of a call."""
    status = main(["explain", *arguments])
    return status, capsys.readouterr().out


def words_of(path):
    return "".join(ET.parse(path).getroot().itertext())


def test_a_foot_in_either_frame_gets_the_same_answer(here, capsys):
    # The right front hip is at (124.8, -61.64) mm, turned by -45°.
    status, out = explained(capsys, "--foot-at", "1", "0.25,0.1,0.05", "--frame", "hip")
    assert status == 1
    assert "right_front cannot place its foot there" in out
    x, y = 0.1248 + (0.25 + 0.1) / 2**0.5, -0.06164 + (0.1 - 0.25) / 2**0.5
    body = explained(capsys, "--foot-at", "right_front", f"{x},{y},0.05", "--out", "a.svg")
    assert body[0] == 1
    assert body[1].splitlines()[0] == out.splitlines()[0]
    rows = [line.split() for line in out.splitlines() if line.startswith("right_front  ")]
    # The tibia bends by 23° at least: sqrt(82² + 140² + 2·82·140 cos 23°) = 217.9 mm.
    table = ["right_front", "reach", "223", "mm", "58", "to", "217.9", "mm"]
    assert (rows[0][:8], len(rows)) == (table, 2)
    picture = here / "results/paper_explain_right_front_0.25_0.1_0.05/explanation.svg"
    assert "nearest possible foot" in words_of(picture)
    assert f"Written to {picture.relative_to(here)}" in out
    assert "wanted foot" in words_of(here / "a.svg")


def test_a_possible_foot_has_status_0(capsys):
    status, out = explained(capsys, "--foot-at", "right_front", "0.2,-0.15,-0.1", "--quiet")
    assert status == 0
    assert out.splitlines() == [
        "right_front can place its foot there; nearest to a limit is its tibia at -122.2°, 57.8° "
        "from its limit of -180°."
    ]


def test_a_possible_foot_and_posture_get_their_joint_angles(capsys):
    """The angles that the command prints put the feet where they should be."""
    leg = load_robot("phantomx-paper").legs[0]
    _, out = explained(capsys, "--foot-at", "1", "0.2,0.03,-0.1", "--frame", "hip")
    row = next(line.split() for line in out.splitlines() if line.startswith("right_front  "))
    q = np.radians([float(cell.removesuffix("°")) for cell in row[1:]])
    # Tenths of a degree at up to 0.27 m.
    np.testing.assert_allclose(foot_position(leg, q), [0.2, 0.03, -0.1], atol=3e-4)
    _, out = explained(capsys, "--pose", "0,0,0.02")
    assert sum(line.endswith("°") for line in out.splitlines()) == 6


@pytest.mark.parametrize(
    "wanted",
    [
        ["--foot-at", "right_front", "0.45,-0.32,-0.10"],
        ["--foot-at", "right_front", "0.06,-0.07,-0.02"],
        ["--foot-at", "1", "0.25,0.1,0.05", "--frame", "hip"],
        ["--foot-at", "left_middle", "0,0.05,0.3"],
        ["--pose", "0,0,0.10"],
        ["--pose", "0.05,0.02,-0.15"],
        ["--pose", "0,0,0.05", "--rpy-deg", "0,20,0"],
        ["--step-length-mm", "400"],
        ["--step-length-mm", "300", "--step-sideways-mm", "100", "--step-turn-deg", "20"],
        ["--robot", "quadruped", "--gait", "crawl", "--step-length-mm", "250"],
    ],
    ids=" ".join,
)
def test_what_is_advised_is_possible(capsys, wanted):
    """Typed in the place of the options that it names."""
    status, out = explained(capsys, *wanted)
    assert status == 1
    (advice,) = (line.removeprefix("  try  ") for line in out.splitlines() if "  try  " in line)
    flags = [word for word in advice.split() if word.startswith("--")]
    kept, words = [], list(wanted)
    while words:
        flag = words.pop(0)
        values = [words.pop(0) for _ in range(2 if flag == "--foot-at" else 1)]
        kept += [flag, *values] if flag not in flags else []
    assert explained(capsys, *kept, *advice.split())[0] == 0


def test_a_posture_that_the_ground_forbids_says_so(capsys):
    _, out = explained(capsys, "--pose", "0,0,-0.15")
    assert "the trunk is 0.1 mm over the ground" in out


def test_a_posture_gets_its_largest_share(here, capsys):
    status, out = explained(
        capsys, "--pose", "0,0,0.05", "--rpy-deg", "0,20,0", "--out", "tilted.png"
    )
    assert status == 1
    assert "Largest share: (0.0, 0.0, 44.3) mm, (0.0, 17.7, 0.0)°" in out
    assert "The controller, which keeps margins, takes" in out
    assert (here / "tilted.png").read_bytes().startswith(b"\x89PNG")
    status, out = explained(capsys, "--rpy-deg", "0,5,0")
    assert status == 0
    assert "the posture is possible" in out


def test_a_walk_gets_its_longest_step(here, capsys):
    status, out = explained(capsys, "--step-length-mm", "400")
    assert status == 1
    assert "step of 400 mm is too much for right_front: the foot would be 289.7 mm" in out
    # A step of 230.8 mm in half of 2 s.
    assert "Longest possible step: 230 mm, which is 230.8 mm/s" in out
    assert "400 mm" in words_of(here / "results/paper_explain_step-length-mm-400/explanation.svg")
    status, out = explained(capsys, "--period", "0.1")
    assert status == 1
    assert "No step length is possible" in out
    status, out = explained(capsys)
    assert status == 0
    assert "the walk is possible" in out


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        pytest.param(
            ["--foot-at", "right_frnt", "0,0,0"],
            'there is no leg "right_frnt"; legs are right_front, right_middle, right_rear, '
            'left_rear, left_middle, left_front.\n  try  "right_front"',
            id="leg",
        ),
        pytest.param(
            ["--foot-at", "9", "0,0,0"], "there is no leg 9; legs are 1 to 6.", id="number"
        ),
        pytest.param(
            ["--foot-at", "1", "0,nan,0"],
            '--foot-at LEG is "0,nan,0"; it must be three numbers with commas between.\n'
            "  try  --foot-at LEG 0.30,-0.12,-0.10",
            id="nan",
        ),
        pytest.param(
            ["--pose", "0,1"],
            '--pose is "0,1"; it must be three numbers with commas between.\n'
            "  try  --pose 0,0,0.05",
            id="pose",
        ),
        pytest.param(
            ["--pose", "0,0,0", "--foot-at", "1", "0,0,0"],
            "--foot-at and a posture are two questions; one of them must go.\n"
            "  try  phasmid explain --pose 0,0,0.05",
            id="two-questions",
        ),
        pytest.param(
            ["--frame", "world"], '--frame is "world"; it must be body or hip.', id="frame"
        ),
        pytest.param(
            ["--foot-at", "1", "0,0,0", "--out", "a.txt"],
            '--out is "a.txt"; it must end in .svg, .png, .pdf.\n  try  --out picture.svg',
            id="kind",
        ),
    ],
)
def test_bad_input_gets_one_sentence(here, capsys, arguments, error):
    assert main(["explain", *arguments]) == 2
    assert capsys.readouterr().err.rstrip("\n") == f"phasmid: {error}"
    assert not list(here.iterdir())


def test_an_older_picture_stays(here, capsys):
    (here / "a.svg").write_text("older")
    call = ["explain", "--foot-at", "1", "0.3,-0.2,-0.1", "--out", "a.svg"]
    assert main(call) == 2
    assert "try  --force" in capsys.readouterr().err
    assert (here / "a.svg").read_text() == "older"
    assert main([*call, "--force"]) == 0
