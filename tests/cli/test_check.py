"""``phasmid check``: robots, walks, postures and foot positions, and one verdict everywhere."""

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from phasmid.advice import servo_verdict
from phasmid.cli import main
from phasmid.gait import gaits_of
from phasmid.kinematics import foot_position
from phasmid.robot import load_robot, robot_to_toml, with_payload
from phasmid.scenario import load_scenario
from phasmid.servo import complete_servo, load_servo
from phasmid.studies import load_study_file
from phasmid.studies.runs import Run, Runner
from phasmid.studio.setting import setting_of

pytestmark = pytest.mark.usefixtures("here")


def checked(capsys, status, line=""):
    """Output and errors of a call that ends with a status."""
    assert main(["check", *line.split()]) == status
    return capsys.readouterr()


def words_of(path):
    return "".join(ET.parse(path).getroot().itertext())


@pytest.mark.parametrize("preset", ["phantomx-paper", "phantomx-mk4", "octopod"])
def test_a_preset_is_listed_in_80_columns(capsys, preset):
    out, _ = checked(capsys, 0, f"--robot {preset}")
    robot = load_robot(preset)
    assert f"{len(robot.legs)} legs, {robot.mass:.3f} kg" in out
    assert out.endswith("possible.\n")
    rows = [line for line in out.splitlines() if line[0].isdigit() or line.startswith("leg ")]
    assert len(rows) == 2 * (1 + len(robot.legs))
    assert max(map(len, rows)) <= 80
    for number, leg in enumerate(robot.legs, 1):
        frame, pose = (row for row in rows if row.startswith(f"{number} {leg.name} "))
        lengths = [float(length) for length in re.split(" {2,}", frame)[1].split("/")]
        assert lengths == pytest.approx(1000 * leg.lengths, rel=5e-4)
        masses = [float(mass) for mass in pose.split("  ")[-1].split("/")]
        assert masses == pytest.approx([1000 * link.mass for link in leg.links], abs=0.05)


def test_payload_and_servo_of_the_options_are_those_of_the_verdict(capsys):
    # 2.65 kg, the payload, and 18 servos that weigh 55 g in place of 54.6 g.
    out, _ = checked(capsys, 0, "--robot phantomx-ax --servo MG996R --payload-g 500")
    assert "3.158 kg" in out
    assert "MG996R at 6 V" in out


def test_a_file_is_refused_with_its_line(here, capsys):
    (here / "s.toml").write_text("[stride]\nstep_length_mm = 400\n", encoding="utf-8")
    assert "try  --step-length-mm 230" in checked(capsys, 2, "s.toml").err
    (here / "r.toml").write_text('name = "r"\n[legs]\n', encoding="utf-8")
    assert "in   r.toml" in checked(capsys, 2, "--robot r.toml").err
    _, err = checked(capsys, 2, "r.toml")
    assert err == "phasmid: r.toml is a robot, no scenario.\n  try  --robot r.toml\n"


def test_a_foot_in_either_frame_gets_the_same_answer(here, capsys):
    # The right front hip is at (124.8, -61.64) mm, turned by -45°.
    out, _ = checked(capsys, 2, "--foot-at 1 0.25,0.1,0.05 --frame hip")
    assert "right_front cannot place its foot there" in out
    x, y = 0.1248 + (0.25 + 0.1) / 2**0.5, -0.06164 + (0.1 - 0.25) / 2**0.5
    body, _ = checked(capsys, 2, f"--foot-at right_front {x},{y},0.05 --out a.svg")
    assert body.splitlines()[0] == out.splitlines()[0]
    rows = [line.split() for line in out.splitlines() if line.startswith("right_front  ")]
    # The tibia bends by 23° at least: sqrt(82² + 140² + 2·82·140 cos 23°) = 217.9 mm.
    table = ["right_front", "reach", "223", "mm", "58", "to", "217.9", "mm"]
    assert (rows[0][:8], len(rows)) == (table, 2)
    assert "wanted foot" in words_of(here / "a.svg")
    assert [path.name for path in here.iterdir()] == ["a.svg"]


def test_a_possible_foot_and_posture_get_their_joint_angles(capsys):
    """The angles that the command prints put the feet where they should be."""
    leg = load_robot("phantomx-paper").legs[0]
    out, _ = checked(capsys, 0, "--foot-at 1 0.2,0.03,-0.1 --frame hip")
    row = next(line.split() for line in out.splitlines() if line.startswith("right_front  "))
    q = np.radians([float(cell.removesuffix("°")) for cell in row[1:]])
    # Tenths of a degree at up to 0.27 m.
    np.testing.assert_allclose(foot_position(leg, q), [0.2, 0.03, -0.1], atol=3e-4)
    out, _ = checked(capsys, 0, "--pose 0,0,0.02")
    assert sum(line.endswith("°") for line in out.splitlines()) == 6


@pytest.mark.parametrize(
    "wanted",
    [
        "--foot-at right_front 0.45,-0.32,-0.10",
        "--foot-at right_front 0.06,-0.07,-0.02",
        "--foot-at 1 0.25,0.1,0.05 --frame hip",
        "--foot-at left_middle 0,0.05,0.3",
        "--pose 0,0,0.10",
        "--pose 0.05,0.02,-0.15",
        "--pose 0,0,0.05 --rpy-deg 0,20,0",
        "--step-length-mm 400",
        "--step-length-mm 300 --step-sideways-mm 100 --step-turn-deg 20",
        "--robot quadruped --gait crawl --step-length-mm 250",
    ],
)
def test_what_is_advised_is_possible(capsys, wanted):
    """Typed in the place of the options that it names."""
    out, _ = checked(capsys, 2, wanted)
    (advice,) = (line.removeprefix("  try  ") for line in out.splitlines() if "  try  " in line)
    options = re.split(" (?=--)", wanted)
    kept = [option for option in options if option.split()[0] not in advice.split()]
    checked(capsys, 0, " ".join([*kept, advice]))


def test_a_posture_gets_its_largest_share(here, capsys):
    out, _ = checked(capsys, 2, "--pose 0,0,0.05 --rpy-deg 0,20,0 --out tilted.png")
    assert "Largest share: (0.0, 0.0, 44.3) mm, (0.0, 17.7, 0.0)°" in out
    assert "The controller, which keeps margins, takes" in out
    assert (here / "tilted.png").read_bytes().startswith(b"\x89PNG")
    assert "the trunk is 0.1 mm over the ground" in checked(capsys, 2, "--pose 0,0,-0.15").out
    assert "the posture is possible" in checked(capsys, 0, "--rpy-deg 0,5,0").out


def test_a_walk_gets_its_longest_step(here, capsys):
    out, err = checked(capsys, 2, "--step-length-mm 400 --out a.svg")
    assert "step of 400 mm is too much for right_front" in err
    # A step of 230.8 mm in half of 2 s.
    assert "Longest possible step: 230 mm, which is 230.8 mm/s" in out
    assert "400 mm" in words_of(here / "a.svg")
    assert "No step length is possible" in checked(capsys, 2, "--period 0.1").out
    out, _ = checked(capsys, 0)
    assert "joint nearest to its limit: right_front.femur" in out
    assert out.endswith("possible.\n")


STRONG = complete_servo(
    {
        "name": "strong",
        "stall_torque": 6.0,
        "no_load_speed": 6.6,
        "armature": 0.012,
        "friction": 0.09,
        "viscous_friction": 0.01,
        "stall_current": 4.1,
    }
)
"""Four times as strong as an AX-12A, and heavier in armature and friction."""

ICE = 0.01
"""Friction of a floor that gives small servos under a load no help."""


def unwrapped(text):
    return re.sub(r"\s+", " ", text.replace("servos: ", ""))


@pytest.mark.parametrize("servo", [STRONG, load_servo("AX-12A")], ids=lambda servo: servo.name)
@pytest.mark.parametrize("name", ["phantomx-paper", "octopod"])
def test_every_command_the_studio_and_a_study_give_one_verdict(here, capsys, name, servo):
    """At one supply and payload, whatever else a command does."""
    overloaded = servo is not STRONG
    robot = replace(load_robot(name), name="mine", servo=servo)
    (here / "mine.toml").write_text(robot_to_toml(robot), encoding="utf-8")
    gait = next(iter(gaits_of(len(robot.legs))))
    payload = 5.0 if overloaded else 0.5
    scenario = load_scenario("paper").replace(
        robot=robot,
        gait=gait,
        period=2.0,
        step_length=0.02,
        step_height=0.015,
        voltage=11.1,
        payload=payload,
        friction=ICE,
    )

    verdict = setting_of(scenario).servo_verdict
    assert verdict == servo_verdict(scenario).as_dict()
    assert verdict["holding"] == ("DOES NOT HOLD" if overloaded else "HOLDS")
    words = " ".join(verdict["lines"])
    assert words.startswith(verdict["holding"])

    load = ["--voltage", "11.1", "--payload-g", f"{1000 * payload:g}", "--friction", f"{ICE:g}"]
    stride = ["--step-length-mm", "20", "--step-height-mm", "15", "--period", "2"]
    fields = ["--robot", "mine.toml", "--gait", gait, *load, *stride]
    for command in ("check", "advise"):
        assert main([command, *fields]) == (2 if overloaded else 0)
        assert words in unwrapped(capsys.readouterr().out)

    short = ["--drive", "servo", "--duration", "0.05", "--no-figures"]
    for command in (["walk"], ["drive", "--velocity", "0.01,0,0"]):
        status = main([*command, *fields, *short, "--out", command[0]])
        printed = capsys.readouterr().out
        assert status in (0, 3)
        assert words in unwrapped(printed)
        # In the first lines: before anything else that is measured.
        assert printed.index(verdict["holding"]) < printed.index("Duration")
        summary = json.loads((here / command[0] / "summary.json").read_text(encoding="utf-8"))
        # What is unknown or infinite is left out there.
        assert summary["servo_verdict"].items() <= verdict.items()
        assert summary["servo_verdict"]["lines"] == verdict["lines"]

    plan = {"kind": "plan", "set": {"duration": 0.1}, "metrics": ["servo_verdict.least_margin"]}
    study, _ = load_study_file(plan | {"axes": {"gait": [gait]}})
    row = Runner(study, scenario, here, here, {}).row(Run(0, "id", {"gait": gait}))
    assert row["servo_verdict.least_margin"] == verdict["least_margin"]


def test_the_studios_verdict_follows_payload_servo_and_gait():
    setting = setting_of(load_scenario("paper").replace(drive="servo"))
    loaded = replace(setting, scenario=setting.scenario.replace(payload=4.0))
    strong = replace(setting, scenario=setting.scenario.replace(servo="MX-28"))
    said = {
        setting.servo_verdict["lines"][0],
        loaded.servo_verdict["lines"][0],
        strong.servo_verdict["lines"][0],
        replace(setting, scenario=setting.scenario.replace(gait="wave")).servo_verdict["lines"][0],
    }
    assert len(said) == 4
    assert loaded.servo_verdict["holding"] == "HOLDS ONLY WITH FRICTION"


def test_a_scenario_whose_servos_do_not_hold_is_impossible(here, capsys):
    heavy = with_payload(load_robot("phantomx-paper"), 8.0)
    (here / "heavy.toml").write_text(robot_to_toml(heavy), encoding="utf-8")
    (here / "trip.toml").write_text('robot = "heavy.toml"\n', encoding="utf-8")
    out, err = checked(capsys, 2, "trip.toml")
    assert "DOES NOT HOLD on any floor: right_middle.femur needs 4.03 N·m" in out
    assert "the AX-12A does not hold this robot in the tripod gait." in err
    assert "try  --gait wave" in err
    assert "HOLDS ONLY WITH FRICTION" in checked(capsys, 0, "trip.toml --gait wave").out
