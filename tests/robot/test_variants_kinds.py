"""Variants of a robot that nobody knows."""

import pytest

from phasmid.errors import InvalidGait, InvalidInput
from phasmid.gait import load_gait
from phasmid.robot import load_robot
from phasmid.robot.variants import with_mass_model, with_mounts


@pytest.mark.parametrize("word", ["foo", None, 3, []])
def test_an_unknown_layout_or_mass_model_is_refused(word):
    robot = load_robot("phantomx-paper")
    with pytest.raises(InvalidInput, match="it must be as-given or perpendicular"):
        with_mounts(robot, word)
    with pytest.raises(InvalidInput, match="it must be as-given or mid-length"):
        with_mass_model(robot, word)


def test_a_variant_of_no_robot_is_refused():
    with pytest.raises(InvalidInput, match="robot is 3; it must be a Robot"):
        with_mounts(3, "as-given")


@pytest.mark.parametrize("count", [None, [4]])
def test_a_number_of_legs_that_is_none_is_refused(count):
    with pytest.raises(InvalidGait, match="it must be a whole number"):
        load_gait("wave", count)
