"""The figure of the sensors shows the last cycle, told over true."""

import numpy as np
import pytest

from phasmid import load_scenario, sense
from phasmid.errors import InvalidInput
from phasmid.reporting import figures, plot


def test_a_recording_with_sensors_has_their_figure(short_walk):
    told = sense(load_scenario("paper"), short_walk)
    assert "sensors" not in figures(short_walk)
    figure = figures(told)["sensors"]
    labels = [axis.get_ylabel() for axis in figure.axes]
    # The synthetic walk knows no angular velocity, so that there is no inertial sensor.
    assert labels == ["femur [°]", "femur load [1]", "foot [N]"]
    assert figure.axes[0].get_xlim() == (2.0, 4.0)


def test_told_is_drawn_over_true_in_degrees(short_walk):
    told = sense(load_scenario("paper"), short_walk)
    true_line, told_line = plot(told, "sensors").axes[0].lines
    last = told.isel(time=slice(200, None))
    angle = np.degrees(last.joint_position.values[:, 0, 1])
    assert np.allclose(true_line.get_ydata(), angle, atol=1e-12)
    angle = np.degrees(last.joint_position_measured.values[:, 0, 1])
    assert np.allclose(told_line.get_ydata(), angle, atol=1e-12)


def test_without_sensors_there_is_nothing_to_draw(short_walk):
    with pytest.raises(InvalidInput, match="the figure sensors needs it"):
        plot(short_walk, "sensors")
