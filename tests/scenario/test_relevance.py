"""Which fields of a scenario do nothing."""

from dataclasses import replace

import pytest

from phasmid.robot import load_robot
from phasmid.scenario import idle_fields, load_scenario
from phasmid.servo import load_servo


@pytest.mark.parametrize(
    ("changes", "sentences"),
    [
        ({"punch": 9.0}, ['punch has no effect with drive "prescribed".']),
        ({"punch": 9.0, "drive": "ideal-servo"}, ['punch has no effect with drive "ideal-']),
        ({"punch": 9.0, "drive": "servo"}, []),
        # The verdict on the servos counts them with every drive.
        ({"voltage": 9.0, "torque_limit": 0.5, "ambient_temperature": 45.0}, []),
        ({"servo": "MX-28"}, []),
        ({"servo": "MX-28", "p_gain": 100.0, "drive": "servo"}, []),
        (
            {"servo": "MX-28", "compliance_slope": 64, "drive": "servo"},
            ["compliance_slope has no effect with the MX-28, whose law"],
        ),
        ({"terrain_start_mm": 9.0}, ['terrain_start_mm has no effect with terrain "flat".']),
        ({"rise_mm": 30.0}, ['rise_mm has no effect with terrain "flat".']),
        ({"rise_mm": 30.0, "terrain": "stairs"}, []),
        ({"block_height_mm": 30.0, "terrain": "stepping-stones"}, []),
        ({"stone_distance_mm": 160.0, "terrain": "blocks"}, ["stone_distance_mm has no effect wi"]),
        ({"terrain_seed": 3, "terrain": "course", "course_level": 1.0}, []),
        ({"beam_height_mm": 40.0, "terrain": "steps"}, ["beam_height_mm has no effect with terra"]),
        ({"wave_height_mm": 3.0, "terrain": "stairs"}, ["wave_height_mm has no effect with terr"]),
        ({"kinetic_friction": 0.3}, ['kinetic_friction has no effect with contact_law "spring-']),
        ({"kinetic_friction": 0.3, "contact_law": "simscape"}, []),
        ({"damping": 500.0, "contact_law": "mujoco"}, ['damping has no effect with contact_law "']),
        ({"imu_rate": 50.0}, ['imu_rate has no effect with measured "nothing".']),
        ({"imu_rate": 50.0, "measured": "everything"}, []),
        ({"p_gain": 100.0, "drive": "servo"}, ["p_gain has no effect with the AX-12A, whose law"]),
        ({"compliance_slope": 64, "drive": "servo"}, []),
        ({"terrain_yaw_deg": 30.0}, ['terrain_yaw_deg has no effect with terrain "flat".']),
        ({"terrain_yaw_deg": 30.0, "patches": [[0.0, 1.0, -1.0, 1.0, 0.2]]}, []),
        # A value that is the default's is no one's wish.
        ({"imu_rate": 100.0, "rise_mm": 20.0}, []),
    ],
)
def test_a_field_that_another_one_leaves_out_is_told(changes, sentences):
    told = idle_fields(load_scenario("paper").replace(**changes))
    assert len(told) == len(sentences)
    for sentence, beginning in zip(told, sentences, strict=True):
        assert sentence.startswith(beginning)


def test_a_servo_with_a_pid_law_has_no_compliance():
    scenario = load_scenario("paper").replace(drive="servo", compliance_slope=64, p_gain=700)
    robot = replace(load_robot("phantomx-paper"), servo=load_servo("XL430-W250"))
    told = 'compliance_slope has no effect with the XL430-W250, whose law is "pid".'
    assert idle_fields(scenario, robot) == [told]
    assert idle_fields(scenario.replace(robot=robot)) == [told]
