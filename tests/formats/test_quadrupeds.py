"""Quadrupeds of hip, thigh and calf, whose feet are beside the planes of their legs.

The numbers are round ones of the size of those on sale.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from phasmid import kinematics
from phasmid.experiment import Command
from phasmid.formats import import_robot, load_robot, save_robot
from phasmid.motion import plan
from phasmid.reporting import summarise
from phasmid.robot import with_values
from phasmid.scenario import load_scenario
from phasmid.simulation import drive, simulate

CORNERS = {"FR": (1, -1), "FL": (1, 1), "RR": (-1, -1), "RL": (-1, 1)}

# Hip's distance ahead and aside of the trunk's middle, offset of the thigh, thigh, calf [m], mass
# of the trunk [kg].
SIZES = {
    "small": (0.18, 0.047, 0.08, 0.2, 0.2, 5.0),
    "unequal": (0.25, 0.05, 0.083, 0.25, 0.22, 9.0),
}


def link(name: str, mass: float, com: tuple[float, ...], box: tuple[float, ...]) -> str:
    x, y, z = (side * side * mass / 12 for side in box)
    return (
        f'<link name="{name}"><inertial><origin xyz="{com[0]} {com[1]} {com[2]}"/>'
        f'<mass value="{mass}"/><inertia ixx="{y + z}" iyy="{x + z}" izz="{x + y}" '
        f'ixy="{0.02 * x}" ixz="0" iyz="{-0.02 * z}"/></inertial></link>'
    )


def joint(name: str, parent: str, child: str, at: tuple[float, ...], axis: str, limit: str) -> str:
    return (
        f'<joint name="{name}" type="{"revolute" if limit else "fixed"}"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{at[0]} {at[1]} {at[2]}"/>'
        + (f'<axis xyz="{axis}"/><limit {limit} effort="40" velocity="20"/>' if limit else "")
        + "</joint>"
    )


def urdf(size: str) -> str:
    """A quadruped whose thighs turn beside the hips' axes, as a URDF file."""
    ahead, aside, offset, thigh, calf, mass = SIZES[size]
    parts = [link("trunk", mass, (0.01, 0.0, 0.0), (2 * ahead, 2 * aside, 0.11))]
    for name, (front, left) in CORNERS.items():
        hip, upper, lower = f"{name}_hip", f"{name}_thigh", f"{name}_calf"
        out = left * offset
        parts += [
            link(hip, 0.6, (front * (2 * ahead - 0.01), 0.1 * out, 0.0), (0.08, 0.08, 0.08)),
            link(upper, 1.0, (0.0, -0.2 * out, -0.1 * thigh), (0.05, 0.05, thigh)),
            link(lower, 0.2, (0.005, 0.0, -0.5 * calf), (0.02, 0.02, calf)),
            f'<link name="{name}_foot"/>',
            # A hip's frame may lie anywhere on its axis, here behind the middle.
            joint(f"{hip}_joint", "trunk", hip, (-front * ahead, left * aside, 0.0), "1 0 0",
                  'lower="-0.8" upper="0.8"'),
            joint(f"{upper}_joint", hip, upper, (2 * front * ahead, out, 0.0), "0 1 0",
                  'lower="-1.0" upper="3.5"'),
            joint(f"{lower}_joint", upper, lower, (0.0, 0.0, -thigh), "0 1 0",
                  'lower="-2.7" upper="-0.9"'),
            joint(f"{name}_foot_joint", lower, f"{name}_foot", (0.0, 0.0, -calf), "", ""),
        ]  # fmt: skip
    return f'<robot name="{size}">{"".join(parts)}</robot>'


@pytest.fixture(params=SIZES)
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / f"{request.param}.urdf"
    path.write_text(urdf(request.param), encoding="utf-8")
    return path


@pytest.mark.skipif(sys.platform == "win32", reason="Pinocchio has no wheels for Windows")
def test_feet_and_masses_are_those_of_pinocchio_from_the_same_file(file: Path) -> None:
    """p_body_foot at random angles φ of the file, θ = signs φ + offsets, to round-off."""
    import pinocchio as pin

    imported = import_robot(file)
    robot, legs = imported.robot, imported.legs
    assert robot is not None
    assert [leg.joints[0][:2] for leg in legs] == ["FR", "RR", "RL", "FL"]
    model = pin.buildModelFromUrdf(str(file))
    data = model.createData()
    assert robot.mass == pytest.approx(
        pin.computeTotalMass(model) + SIZES[file.stem][-1], rel=1e-12
    )
    ids = np.array([[model.getJointId(name) for name in leg.joints] for leg in legs])
    signs, offsets = (np.array([getattr(leg, key) for leg in legs]) for key in ("signs", "offsets"))
    at = np.array([[model.joints[int(j)].idx_q for j in row] for row in ids])
    rng = np.random.default_rng(1)
    for _ in range(20):
        file_q = rng.normal(size=(4, 3))
        state = pin.neutral(model)
        state[at] = file_q
        pin.framesForwardKinematics(model, data, state)
        theirs = [
            data.oMf[model.getFrameId(f"{leg.joints[0][:2]}_foot")].translation for leg in legs
        ]
        q = signs * file_q + offsets
        ours = kinematics.body_from_hip(robot, kinematics.foot_position(robot.arrays, q))
        # The body's origin is amid the hips, which here is the trunk's.
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_it_walks_and_is_driven_in_a_crawl(file: Path) -> None:
    """By compliant servos, with ground sensing and safety; the start takes 1 s of 8 s."""
    scenario = load_scenario("paper").replace(robot=load_robot(file), gait="crawl", duration=6.0)
    travel = summarise(simulate(scenario, plan(scenario)))["travel"]
    assert travel["distance"] == pytest.approx(travel["commanded_distance"], rel=0.05)
    scenario = scenario.replace(duration=8.0)
    recording = drive(scenario, commands=Command(velocity=(0.05, 0.0, 0.0)))
    assert recording.attrs["ending"] == "COMPLETED"
    assert np.ptp(recording["body_position"].values[:, 0]) > 0.85 * 0.05 * 8.0


def test_the_stance_of_a_file_is_kept_where_its_gait_does_not_support(tmp_path: Path) -> None:
    """The centre of mass is 80 mm ahead: another stance with room would not support either."""
    robot = with_values(load_robot("quadruped"), {"body.com": [0.08, 0, 0]})
    save_robot(robot, tmp_path / "ahead.xml")
    again = import_robot(tmp_path / "ahead.xml").robot
    assert again is not None
    np.testing.assert_allclose(
        again.arrays.neutral_foot, robot.arrays.neutral_foot, rtol=0, atol=1e-6
    )
