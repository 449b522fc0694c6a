"""What the summary and the figures tell of the servos, against numbers made by hand."""

import io

import numpy as np
import pytest

from phasmid.recording import new_recording
from phasmid.reporting import print_summary, summarise
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario

SERVO = load_robot("phantomx-paper").servo


@pytest.fixture
def loaded(short_walk):
    """A walk on servos that draw 0.2 A, but the second leg's femur 1.2 A; one of them gives up."""
    time = short_walk["time"].values
    channels = {name: short_walk[name].values for name in short_walk.data_vars}
    shape = (len(time), 6, 3)
    current = np.full(shape, 0.2)
    current[:, 1, 1] = 1.2
    duty = np.full(shape, 0.1)
    # From 1 s to 2 s of 4 s.
    duty[(time >= 1.0) & (time < 2.0), 1, 1] = -1.0
    temperature = 25.0 + np.zeros(shape)
    temperature[:, 1, 1] = np.linspace(25.0, 31.0, len(time))
    down = np.zeros(shape, dtype=bool)
    down[time >= 3.0, 4, 2] = True
    channels |= {
        "servo_duty": duty,
        "servo_current": current,
        "servo_temperature": temperature,
        "servo_shutdown": down,
    }
    attributes = {str(name): value for name, value in short_walk.attrs.items() if name != "format"}
    return new_recording(time, channels, attributes | {"drive": "servo"})


def test_shares_heat_and_shutdown_are_as_computed_by_hand(loaded):
    # Samples of 10 ms: shares to 1/400.
    servos = summarise(loaded)["servos"]
    assert servos["saturated"][1][1] == pytest.approx(0.25, abs=1 / 400)
    assert servos["saturated"][0] == [0.0, 0.0, 0.0]
    assert servos["peak_temperature"][1][1] == servos["final_temperature"][1][1] == 31.0
    assert servos["peak_temperature"][0] == [25.0, 25.0, 25.0]
    assert servos["shutdown_time"][4] == [None, None, 3.0]


def test_what_makes_the_servos_doubtful_is_said(loaded):
    warnings = summarise(loaded)["warnings"]
    said = [sentence for sentence in warnings if "servo of the" in sentence]
    assert said == [
        "The servo of the left middle tibia shut down at 3.00 s.",
        "The servo of the right middle femur gives all it has 25 % of the time and cannot follow.",
    ]


def test_limits_of_servos_with_their_own_law_are_those_at_their_supply(walk):
    # The stall torque falls by kept k (12 - 9) / R; the friction stays.
    scenario = load_scenario("paper").replace(drive="servo", voltage=9.0)
    motor = SERVO.motor
    recording = walk(duration=2.0, interval=0.01, scenario=scenario, drive="servo")
    summary = summarise(recording)
    weaker = (1 - motor.load_loss) * motor.constant * 3.0 / motor.resistance
    stall = SERVO.stall_torque - weaker
    assert summary["robot"]["stall_torque"] == pytest.approx(stall, rel=1e-12)
    torque, speed = summary["torque"]["simulation"], summary["speed"]
    assert torque["largest_over_stall"] == pytest.approx(torque["largest"] / stall, rel=1e-12)
    assert speed["largest_over_no_load"] == pytest.approx(
        speed["largest"] / motor.no_load_speed(9.0), rel=1e-12
    )
    sink = io.StringIO()
    print_summary(summary, file=sink)
    text = " ".join(sink.getvalue().split())
    assert f"stall {stall:.4g} N·m at 9 V" in text
    assert "% of stall at 9 V" in text
    assert "no-load speed at 9 V" in text


def test_the_printed_summary_has_a_line_on_load_and_the_warmest_servo(loaded):
    sink = io.StringIO()
    print_summary(summarise(loaded), file=sink)
    text = " ".join(sink.getvalue().split())
    assert "Servos 12 V; at full output 25.0 % of the time (right middle femur)" in text
    assert "warmest 31 °C (right middle femur)" in text
