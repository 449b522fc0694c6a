"""Compiled functions of the safety monitor and the safety filter, called at each update."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, internal
from phasmid.control.safety import AMBIENT, MonitorParameters, MonitorState, Signal
from phasmid.control.safety_filter import Violation

HEAT_STEP = 0.1
"""Time step of overload and temperature [s]."""


@compiled
def predicted_tilt(orientation: np.ndarray, turn: np.ndarray) -> float:
    """Return the angle of the body's z axis to the vertical after a turn along its tangent [rad].

    Args:
        orientation: Orientation of the body, w x y z, of any norm, shape (4,).
        turn: Angular velocity times the time of the turn, body axes [rad], shape (3,).
    """
    w, x, y, z = orientation[0], orientation[1], orientation[2], orientation[3]
    size = w * w + x * x + y * y + z * z
    # The vertical in body axes; it turns against the body.
    a, b = 2 * (x * z - w * y) / size, 2 * (y * z + w * x) / size
    c = (w * w - x * x - y * y + z * z) / size
    da, db, dc = b * turn[2] - c * turn[1], c * turn[0] - a * turn[2], a * turn[1] - b * turn[0]
    return math.atan2(math.hypot(a + da, b + db), c + dc)


@internal
def integrate_loads(
    state: MonitorState, parameters: MonitorParameters, load: np.ndarray, dt: float
) -> int:
    """Integrate overload time and temperature of the servos; return `Signal` bits.

    Args:
        state: State of the monitor, changed.
        parameters: Thresholds and the servo.
        load: Outputs of the servos, shape (L, 3).
        dt: Time step [s].
    """
    legs = load.shape[0]
    state.load_interval += dt
    for leg in range(legs):
        for joint in range(3):
            state.squared_load[leg, joint] += dt * load[leg, joint] ** 2
    if state.load_interval < HEAT_STEP:
        return 0
    longest, hottest = 0.0, -math.inf
    for leg in range(legs):
        for joint in range(3):
            time, temperature = 0.0, state.temperature[leg, joint]
            if abs(load[leg, joint]) > parameters.load_share:
                time = state.overload_time[leg, joint] + state.load_interval
            heat = state.squared_load[leg, joint] * parameters.power
            loss = (temperature - AMBIENT) / parameters.thermal_resistance * state.load_interval
            temperature += (heat - loss) / parameters.heat_capacity
            state.overload_time[leg, joint], state.temperature[leg, joint] = time, temperature
            state.squared_load[leg, joint] = 0.0
            longest, hottest = max(longest, time), max(hottest, temperature)
    state.load_interval = 0.0
    state.hot = hottest > (parameters.cool if state.hot else parameters.hot)
    signals = Signal.OVERLOAD.value if longest > parameters.load_time else 0
    return signals | (Signal.HEAT.value if state.hot else 0)


@compiled
def check_signals(
    states: np.ndarray,
    parameter_records: np.ndarray,
    dt: float,
    q: np.ndarray,
    qd: np.ndarray,
    load: np.ndarray,
    orientation: np.ndarray,
    angular_velocity: np.ndarray,
) -> int:
    """Validate sensor values, predict the tilt and integrate servo loads; return `Signal` bits.

    Args:
        states: `MonitorState`, changed, shape (1,).
        parameter_records: `MonitorParameters`, shape (1,).
        dt: Time since the last observation [s]; 0 without measured loads.
        q: Joint angles [rad], shape (L, 3).
        qd: Joint speeds [rad/s], shape (L, 3).
        load: Outputs of the servos, shape (L, 3).
        orientation: Orientation of the body, w x y z, shape (4,).
        angular_velocity: Of the body, body axes [rad/s], shape (3,).
    """
    state, parameters, signals = states[0], parameter_records[0], 0
    for leg in range(q.shape[0]):
        for joint in range(3):
            if not math.isfinite(q[leg, joint]):
                signals |= Signal.JOINT_POSITION.value
            if not math.isfinite(qd[leg, joint]):
                signals |= Signal.JOINT_VELOCITY.value
            if not math.isfinite(load[leg, joint]):
                signals |= Signal.JOINT_LOAD.value
    turn = angular_velocity * parameters.tip_time
    if not math.isfinite(turn[0] + turn[1] + turn[2]):
        signals |= Signal.ANGULAR_VELOCITY.value
        turn[:] = 0.0
    state.tilt = 0.0
    # A sensor without a reading may send zeros.
    if 0.25 <= np.sum(orientation**2) < math.inf:
        state.tilt = predicted_tilt(orientation, turn)
    else:
        signals |= Signal.ORIENTATION.value
    if state.tilt > parameters.tilt:
        signals |= Signal.TILT.value
    if not signals & Signal.JOINT_LOAD.value:
        signals |= integrate_loads(state, parameters, load, dt)
    return signals


@compiled
def target_violations(
    q: np.ndarray,
    v: np.ndarray,
    torque: np.ndarray,
    last: np.ndarray,
    limits: np.ndarray,
    reach: float,
) -> int:
    """Return `Violation` bits of joint targets.

    Args:
        q: Angles [rad], shape (L, 3).
        v: Speeds [rad/s], shape (L, 3).
        torque: Torques [N·m], shape (L, 3).
        last: Angles of the last targets [rad], shape (L, 3).
        limits: Lowest and highest angles [rad], shape (2, L, 3).
        reach: Largest change of an angle [rad].
    """
    violations = 0
    for leg in range(q.shape[0]):
        for joint in range(3):
            x = q[leg, joint]
            # The sum of such small numbers is finite where all of them are.
            if not math.isfinite(x + v[leg, joint] + torque[leg, joint]):
                violations |= Violation.NOT_FINITE.value
            if x < limits[0, leg, joint] or x > limits[1, leg, joint]:
                violations |= Violation.BEYOND_LIMITS.value
            if abs(x - last[leg, joint]) > reach:
                violations |= Violation.TOO_FAR.value
    return violations
