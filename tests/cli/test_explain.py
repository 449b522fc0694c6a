"""``phasmid explain``: its answers, pictures and refusals."""

import xml.etree.ElementTree as ET

import pytest

from phasmid.cli import main

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
    assert rows == [["right_front", "reach", "223", "mm", "58", "to", "217.9", "mm", *rows[0][8:]]]
    picture = here / "results/paper_explain_right_front_0.25_0.1_0.05/explanation.svg"
    assert "nearest possible foot" in words_of(picture)
    assert f"Written to {picture.relative_to(here)}" in out
    assert "wanted foot" in words_of(here / "a.svg")


def test_a_possible_foot_has_status_0(capsys):
    status, out = explained(capsys, "--foot-at", "right_front", "0.2,-0.15,-0.1", "--quiet")
    assert status == 0
    assert out.splitlines() == [
        "right_front can place its foot there: its tibia is 57.8° from a limit, the nearest one."
    ]


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
    assert "stride of 400 mm puts right_front at 0.324 m" in out
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
