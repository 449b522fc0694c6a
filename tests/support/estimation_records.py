"""Records of the ground estimator, whose functions Python calls in tests."""

import numpy as np

from phasmid.control.estimation import EstimatorSettings
from phasmid.control.estimation.state import (
    ESTIMATOR_PARAMETERS,
    ESTIMATOR_STATE,
    MEASUREMENTS,
    EstimatorParameters,
    clear,
    parameters_of,
)
from phasmid.control.records import fill, view_of
from phasmid.robot import load_robot
from phasmid.units import STANDARD_GRAVITY

ROBOT = load_robot("phantomx-mk4")


def new_state():
    states = np.zeros(1, ESTIMATOR_STATE)
    clear(states)
    return states.view(np.recarray)[0]


def new_measurements():
    return np.zeros(1, MEASUREMENTS).view(np.recarray)[0]


def new_parameters(settings=None, dt=0.005, robot=ROBOT, **changed):
    """Parameters of a robot's estimator, some of which are changed."""
    records = np.zeros(1, ESTIMATOR_PARAMETERS)
    parameters = records.view(np.recarray)[0]
    view = view_of(records, EstimatorParameters, len(robot.legs))
    fill(view, parameters_of(robot, settings or EstimatorSettings(), dt, STANDARD_GRAVITY))
    for name, value in changed.items():
        setattr(parameters, name, value)
    return parameters
