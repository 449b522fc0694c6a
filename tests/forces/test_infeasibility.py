"""Loads that the feet cannot give: which feet, which limit, by how much."""

import numpy as np
import pytest

from phasmid.errors import InfeasibleLoad
from phasmid.forces import Contacts, JointLoad, share_load

FEET = np.array([[0.2, -0.2, -0.1], [-0.2, -0.2, -0.1], [-0.2, 0.2, -0.1], [0.2, 0.2, -0.1]])
NAMES = ("right_front", "right_rear", "left_rear", "left_front")
FEMUR = np.broadcast_to(np.array([[0, -0.1, -0.08], [0.15, 0, 0], [0, 0.1, 0.02]]), (4, 3, 3))
"""A normal force of 1 N asks 0.1 N·m of the femur and 0.02 N·m of the tibia."""
ALL, THREE = [1.0, 1, 1, 1], [1.0, 1, 1, 0]
WEIGHT = [0, 0, 26.0, 0, 0, 0]
EACH = "right_front, right_rear, left_rear and left_front"


def refused(share, wrench, model="friction-cone", *, limit=np.inf, friction=0.7, time=None):
    contacts = Contacts(FEET, np.array(share), friction=friction, leg_names=NAMES)
    joints = JointLoad(FEMUR, np.zeros((4, 3)), limit)
    with pytest.raises(InfeasibleLoad) as caught:
        share_load(contacts, np.array(wrench, dtype=float), model, joints=joints, time=time)
    return caught.value


@pytest.mark.parametrize(
    ("case", "what", "hint"),
    [
        # The wrench is a weight at x = y = 2/26 m. The diagonal x + y = 0 through the other two
        # feet is the lever's axis, right_rear at x + y = -0.4: N = -26 * (4/26) / 0.4 = -10 N.
        (
            {"share": THREE, "wrench": [0, 0, 26, 2, -2, 0]},
            "with right_front, right_rear and left_rear standing, foot right_rear would have to "
            "pull with 10 N",
            "the centre of mass further inside",
        ),
        # 20 N sideways, 0.7 * 26 = 18.2 N of them held; all feet together lack 1.8 N.
        (
            {"share": ALL, "wrench": [20, 0, 26, 0, 0, 0]},
            f"with {EACH} standing, feet {EACH} would slip; friction of 0.7 falls short by 0.394, "
            "0.506, 0.506 and 0.394 N.",
            "more friction",
        ),
        # 26 / 4 = 6.5 N on each foot: 0.65 N·m.
        (
            {"share": ALL, "wrench": WEIGHT, "limit": np.array([9.0, 0.5, 9.0])},
            f"with {EACH} standing, joints right_front.femur, right_rear.femur, left_rear.femur "
            "and left_front.femur would need 0.65, 0.65, 0.65 and 0.65 N·m; the limit is 0.5 N·m.",
            "stronger servos",
        ),
        # Feet at (0.2, -0.2) and (-0.2, 0.2) give the weight and no moment about the line between
        # them, along which (1, -1, 0) N·m lies: all of its sqrt(2) N·m is missing.
        (
            {"share": [1.0, 0, 1, 0], "wrench": [0, 0, 26, 1, -1, 0], "time": np.array(0.25)},
            "at 0.25 s: feet right_front and left_rear alone cannot give the load; 1.41 N·m of it",
            "three standing feet or more",
        ),
        # Through foot 3 at (-0.2, 0.2) the weight gives the moments (5.2, 5.2, 0) N·m.
        (
            {"share": [0.0, 0, 1, 0], "wrench": [0, 0, 26, 5.2, 8.2, 0]},
            "foot left_rear alone cannot give the load; 3 N·m of it would be missing.",
            "three standing feet or more",
        ),
    ],
)
def test_an_infeasible_load_is_explained_by_feet_limit_and_excess(case, what, hint):
    error = refused(**case)
    assert error.what.startswith(what)
    assert error.hint.startswith(hint)
    assert error.exit_status == 2


def test_the_first_sample_that_fails_is_named_by_its_index():
    wrench = np.tile(np.array(WEIGHT), (2, 3, 1))
    wrench[1, 1:, 0] = 30.0
    contacts = Contacts(np.tile(FEET, (2, 3, 1, 1)), np.tile(np.array(ALL), (2, 3, 1)))
    times = np.arange(6.0).reshape(2, 3)
    with pytest.raises(InfeasibleLoad) as caught:
        share_load(contacts, wrench, "smallest-largest-load", time=times)
    error = caught.value
    assert (error.index, error.limit) == ((1, 1), "friction")
    assert error.what.startswith("sample 1, 1 at 4 s: with 1, 2, 3 and 4 standing, feet 1, 2, 3 a")


@pytest.mark.parametrize("model", ["minimum-norm", "friction-cone", "minimum-torque"])
def test_fewer_than_three_feet_give_what_they_can(model):
    # Two feet on a diagonal under their midpoint: half each, whatever is made least but torque,
    # whose joints are alike here. One foot: the force through it.
    joints = JointLoad(FEMUR, np.zeros((4, 3)))
    two = Contacts(FEET, np.array([1.0, 0, 1, 0]))
    force = share_load(two, np.array(WEIGHT), model, joints=joints)
    assert force[:, 2] == pytest.approx([13, 0, 13, 0], abs=1e-9)
    one = Contacts(FEET, np.array([0.0, 0, 1, 0]))
    push = np.array([3.0, 0, 26])
    wrench = np.concatenate([push, np.cross(FEET[2], push)])
    assert share_load(one, wrench, model, joints=joints)[2] == pytest.approx(push, abs=1e-9)
    none = share_load(Contacts(FEET, np.zeros(4)), np.zeros(6), model, joints=joints)
    assert np.abs(none).max() == 0


def test_three_feet_on_a_line_are_named():
    feet = np.array([[-0.2, 0, -0.1], [0, 0, -0.1], [0.2, 0, -0.1], [0, 0.2, -0.1]])
    contacts = Contacts(feet, np.array([True, True, True, False]), leg_names=NAMES)
    with pytest.raises(InfeasibleLoad, match="right_rear and left_rear stand on one line and ca"):
        share_load(contacts, np.array([0, 0, 26.0, 1.0, 0, 0]))
    # Straight above the line they can.
    force = share_load(contacts, np.array(WEIGHT))
    assert force[:, 2] == pytest.approx([26 / 3, 26 / 3, 26 / 3, 0], abs=1e-9)


def test_feet_that_are_nearly_on_one_line_are_not_said_to_be_on_it():
    # A foot 14 pm off a line gives 1 N·m about it with 7e10 N. What is left over of 26 N is the
    # round-off of these, 1e-5 N, far above the 3e-8 N that may be missing.
    feet = np.array([[-0.21, 0, -0.1], [0.013, 1.37e-11, -0.1], [0.2, 0, -0.1]])
    wrench = np.array([0, 0, 26.0, 1.0, 0, 0])
    with pytest.raises(InfeasibleLoad, match="feet 1, 2 and 3 stand nearly on one line and can"):
        share_load(Contacts(feet, np.ones(3)), wrench, "weighted-minimum-norm")
