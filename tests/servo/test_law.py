"""The servo's motor, gears, heat and protection, on a test bench."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from phasmid.servo import load_servo, servo_names
from phasmid.servo.law import longest_servo_step
from phasmid.servo.law_kernels import Shutdown
from support.servo_bench import Bench

AX = load_servo("AX-12A")
TICK = AX.resolution
NEVER = {"overload_time": 1e9, "temperature_limit": 1e9}


def step_response(servo, law, goal, inertia, load, until):
    """The same equations by scipy: angle and speed of rotor and output, at `until`."""
    m = servo.motor
    J, K, D = servo.armature, servo.gear_stiffness, servo.gear_stiffness * servo.gear_damping_time

    def rates(_, x):
        angle, speed, output, turning = x
        push = m.constant * (12.0 * law(goal - output) - m.constant * speed) / m.resistance
        gear = K * (angle - output) + D * (speed - turning)
        friction = (m.coulomb + m.load_loss * abs(push)) * np.sign(speed) + m.viscous * speed
        return [speed, (push - friction - gear) / J, turning, (gear - load) / inertia]

    # The rotor only moves ahead in this time, so that no corner of the friction is passed.
    start = [0.0, 1e-9, 0.0, 0.0]
    return solve_ivp(rates, (0.0, until), start, rtol=1e-10, atol=1e-12, max_step=1e-3).y[:, -1]


def compliance(servo, error):
    """Share of full output at an error [rad], without a margin."""
    punch, reach = servo.punch / 1023, servo.compliance_slope[1] * servo.resolution
    return math.copysign(min(punch + (1 - punch) * abs(error) / reach, 1.0), error)


def proportional(servo, error):
    """Share of full output at an error [rad]."""
    return np.clip(servo.p_gain / 128 / 885 * error / servo.resolution, -1.0, 1.0)


@pytest.mark.parametrize(("name", "law"), [("AX-12A", compliance), ("MX-28", proportional)])
def test_a_step_is_answered_as_an_independent_solution_says(name, law):
    # Symplectic Euler errs in proportion to the step, so that halving it halves the error. A
    # finer sensor and no play leave equations that are smooth while the rotor moves ahead.
    servo = replace(load_servo(name), backlash=0.0, compliance_margin=(0.0, 0.0))
    scale = servo.resolution / 1e-6
    servo = replace(servo, resolution=1e-6, p_gain=servo.p_gain / scale)
    if law is compliance:
        # Its slope counts in ticks, up to 128: a coarser sensor, and the goal many slopes away.
        servo = replace(servo, resolution=1e-4, compliance_slope=(128.0, 128.0))
    goal, inertia, until = 0.3, 3e-3, 0.05
    expected = step_response(servo, lambda error: law(servo, error), goal, inertia, 0.0, until)
    assert expected[1] > 0
    errors = []
    for dt in (2e-4, 1e-4, 0.5e-4):
        bench = Bench(replace(servo, control_period=dt), dt, inertia=inertia)
        bench.run(until, goal)
        errors.append(max(abs(bench["angle"] - expected[0]), abs(bench.angle[0] - expected[2])))
    assert errors[0] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.2)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("supply", [1.0, 0.75])
@pytest.mark.parametrize("name", servo_names())
def test_a_servo_lifts_what_is_below_its_stall_torque_and_nothing_above(name, supply):
    # k (V/R) (1 - c1) - c0, from rest: half a per cent below it turns, half above it sinks, since
    # friction holds no more than the motor lifts.
    servo = replace(load_servo(name), **NEVER, torque_limit=1.0)
    voltage = supply * servo.rated_voltage
    stall = servo.motor.stall_torque(voltage)
    moved = []
    for share in (0.995, 1.005):
        bench = Bench(servo, voltage=voltage, load=share * stall)
        bench["angle"] = servo.backlash / 2 + share * stall / servo.gear_stiffness
        for _ in range(1000):
            bench.step(10.0)
            assert abs(bench["torque"]) <= stall * (1 + 1e-12)
        moved.append(np.sign(bench.angle[0]))
        # A motor that is dragged back generates beside what the supply drives through it.
        back = servo.motor.constant * max(-bench["speed"], 0.0)
        assert bench["current"] <= (voltage + back) / servo.motor.resistance * (1 + 1e-12)
    assert moved == [1.0, -1.0]


EXTENDED = replace(
    AX,
    **NEVER,
    external_loss=0.05,
    stribeck_friction=0.03,
    stribeck_load_loss=0.08,
    stribeck_external_loss=0.06,
    quadratic_external_loss=0.02,
    stribeck_speed=1.5,
    stribeck_exponent=1.2,
)
"""An AX-12A with the friction model M6."""


def test_a_servo_with_all_terms_of_friction_meets_its_data_sheet():
    # From rest it lifts half a per cent less than the stall torque of the sheet and no half more;
    # without load it turns at the sheet's speed, where the friction that fades is nearly gone.
    moved = []
    for share in (0.995, 1.005):
        load = share * EXTENDED.stall_torque
        bench = Bench(EXTENDED, load=load)
        bench["angle"] = EXTENDED.backlash / 2 + load / EXTENDED.gear_stiffness
        bench.run(1.0, 10.0)
        moved.append(np.sign(bench.angle[0]))
    assert moved == [1.0, -1.0]
    bench = Bench(replace(EXTENDED, backlash=0.0))
    bench.run(1.0, 100.0)
    assert bench["speed"] == pytest.approx(EXTENDED.no_load_speed, rel=1e-6)


def test_stribeck_friction_holds_at_rest_and_lets_go_in_motion():
    # A load between the friction in motion and that at rest does not start a servo that has shut
    # down, and stops one that turns against it; it keeps one turning that it drives.
    servo = replace(AX, **NEVER, backlash=0.0, stribeck_friction=0.1, stribeck_speed=0.5)
    motor = servo.motor
    load = -(motor.coulomb + 0.05)
    for speed, moves in ((0.0, False), (-3.0, False), (3.0, True)):
        bench = Bench(servo, load=load)
        bench["angle"], bench["shutdown"] = load / servo.gear_stiffness, Shutdown.FAILURE
        bench["speed"] = bench.speed[0] = speed
        bench.run(0.5, 0.0)
        assert (bench.angle[0] > 1.0) == moves


@pytest.mark.parametrize("supply", [1.0, 0.75])
@pytest.mark.parametrize("name", servo_names())
def test_an_unloaded_servo_turns_at_its_no_load_speed(name, supply):
    # V = R i0 + k w0 with k i0 (1 - c1) = c0 + b w0: the steady state of the discrete step too.
    servo = replace(load_servo(name), **NEVER, torque_limit=1.0, backlash=0.0)
    voltage = supply * servo.rated_voltage
    bench = Bench(servo, voltage=voltage)
    # The slowest rotor needs 0.1 s to e, and 3 s to a round-off.
    bench.run(3.0, 100.0)
    motor, expected = servo.motor, servo.motor.no_load_speed(voltage)
    assert bench["speed"] == pytest.approx(expected, rel=1e-6)
    current = (voltage - motor.constant * expected) / motor.resistance
    assert bench["current"] == pytest.approx(current, rel=1e-6)


def sheet_error(load, stall):
    """Ticks of position error at a load, by the data sheet alone: margin, punch, slope, stall."""
    punch = 32 / 1023
    return 1 + 32 * (load / stall - punch) / (1 - punch)


@pytest.mark.parametrize("share", [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97])
@pytest.mark.parametrize("voltage", [12.0, 9.0])
def test_a_lifted_load_is_held_with_the_error_of_the_data_sheet(voltage, share):
    # margin + slope (load/stall - punch)/(1 - punch) ticks, stall being 1.5 N m times V/12. Lifted
    # in steps of a fiftieth of a tick, so that no swing carries it further. The friction c0, which
    # the sheet does not tell, costs up to 32 c0/(0.75 stall) (1 - load/stall) at 9 V; half a tick
    # is the sensor's.
    load = share * 1.5 * voltage / 12
    bench = Bench(replace(AX, **NEVER), voltage=voltage, load=load)
    bench["angle"] = AX.backlash / 2 + load / AX.gear_stiffness
    for k in range(4000):
        bench.step(k * 0.02 * TICK)
    bench.run(3.0, 80 * TICK)
    assert bench["speed"] == 0.0
    expected = sheet_error(load, 1.5 * voltage / 12)
    error = 80 - bench.angle[0] / TICK
    friction = 32 * AX.friction / (0.75 * AX.stall_torque) * (1 - share)
    assert error == pytest.approx(expected, abs=0.5 + friction)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("voltage", [12.0, 9.0, 15.0])
def test_no_load_from_either_side_gets_more_than_the_stall_torque_of_a_joint(direction, voltage):
    # The maker's stall torque at 12 V is the most, whatever the supply; below it is that of the
    # motor. A load of three times as much drags the joint away, and the rotor with it.
    stall = AX.motor.stall_torque(min(voltage, 12.0))
    bench = Bench(replace(AX, **NEVER), voltage=voltage, load=direction * 3 * stall)
    for _ in range(300):
        bench.step(0.0)
        assert abs(bench["torque"]) <= stall * (1 + 1e-12)
        wound = AX.backlash / 2 + stall / AX.gear_stiffness
        assert abs(bench["angle"] - bench.angle[0]) <= wound + 1e-3 * abs(bench.speed[0]) + 1e-9
    # Once the output is full it falls as freely as 3 - 1 stall torques let it: J a = -2 stall.
    before = bench.speed[0]
    bench.run(0.1, 0.0)
    fallen = -direction * 0.1 * 2 * stall / bench.inertia
    assert bench.speed[0] - before == pytest.approx(fallen, rel=1e-9)


def test_a_command_is_answered_after_the_servos_delay_and_then_as_if_there_were_none():
    # 6 ms at 1 ms a step: the same motion to the last bit, 6 steps later. Published measurements
    # of the AX-12+ put 17 to 50 ms between a command and the first motion.
    late, prompt = Bench(AX, delayed=True), Bench(AX)
    steps = round(AX.delay / 1e-3)
    assert steps == 6
    moves = []
    for bench in (late, prompt):
        angles = []
        for _ in range(200):
            bench.step(5 * TICK * 3)
            angles.append(bench.angle[0])
        moves.append(np.array(angles))
    assert (moves[0][:steps] == 0.0).all()
    np.testing.assert_array_equal(moves[0][steps:], moves[1][:-steps])
    first = int(np.argmax(moves[0] > math.radians(0.05)))
    assert 15 <= first <= 50


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_lowered_load_is_held_with_less_since_friction_helps(share):
    # Slipping down stops where k i (1 + c1) + c0 = load with i = duty V/R: the other side of the
    # hysteresis. Ends of ticks: it stops within the tick in which the output is enough.
    motor, load = AX.motor, share * 1.5
    bench = Bench(replace(AX, **NEVER), load=load)
    bench.run(4.0, 0.0)
    duty = (load - motor.coulomb) / (1 + motor.load_loss) / motor.constant * motor.resistance / 12
    punch = 32 / 1023
    expected = 1 + 32 * (duty - punch) / (1 - punch)
    assert -bench.angle[0] / TICK == pytest.approx(expected, abs=1.0)
    assert -bench.angle[0] / TICK < sheet_error(load, 1.5) - 3


def test_within_the_margin_there_is_no_output_and_beyond_it_the_punch():
    # Error e ticks: 0 for e <= margin, else punch + (1 - punch)(e - margin)/slope, up to the limit;
    # each direction has its own margin and slope.
    servo = replace(
        AX,
        compliance_margin=(2.0, 1.0),
        compliance_slope=(64.0, 16.0),
        punch=100.0,
        torque_limit=0.9,
    )
    p = 100 / 1023
    up = {1: 0.0, 2: p + (1 - p) / 16, 9: p + (1 - p) / 2, 17: 0.9, 300: 0.9}
    down = {1: 0.0, 2: 0.0, 3: p + (1 - p) / 64, 34: p + (1 - p) / 2, 66: 0.9}
    for ticks, expected in [*up.items(), *((-e, -d) for e, d in down.items())]:
        bench = Bench(servo)
        bench.step(ticks * TICK)
        assert bench["duty"] == pytest.approx(expected, abs=1e-15)


def test_a_pid_servo_answers_error_and_change_in_its_makers_units():
    # duty = (P/128 e + D/16 de)/885, de the change per control period, smoothed to first order:
    # after one period of a jump by e it is e T/(T + tau).
    servo = load_servo("XL430-W250")
    bench = Bench(servo)
    bench.step(10 * servo.resolution)
    smoothed = 10 * 1e-3 / (1e-3 + 10e-3)
    assert bench["duty"] == pytest.approx((640 / 128 * 10 + 4000 / 16 * smoothed) / 885, rel=1e-12)


def test_position_and_goal_are_read_in_whole_ticks_once_a_period_within_the_joints_limits():
    # The output follows from round(goal/tick) - round(position/tick) at each fourth step.
    bench = Bench(replace(AX, control_period=4e-3))
    bench.limits[1, 0] = 12.4 * TICK
    bench.put(0.4 * TICK)
    errors = []
    for goal in (5.6, 6.0, 7.0, 8.0, 9.4, 20.0, 20.0, 20.0, 20.0):
        bench.step(goal * TICK, blocked=True)
        errors.append(bench["error"])
    assert errors == [6, 6, 6, 6, 9, 9, 9, 9, 12]


def test_friction_holds_a_servo_without_power_up_to_its_size():
    # |load| < c0 = 0.0275 N m: the rotor does not move at all, not even slowly.
    bench = Bench(AX, load=0.0274)
    bench["shutdown"] = Shutdown.OVERLOAD
    bench.angle[0] = -AX.backlash / 2 - 0.0274 / AX.gear_stiffness
    bench.run(1.0, 0.0)
    assert (bench["angle"], bench["speed"]) == (0.0, 0.0)


def test_without_power_a_load_beyond_the_friction_turns_it():
    # Constant speed where load = c0 + b w; with both inertias it takes (J + I)/b, below 1 s, to e.
    bench = Bench(AX, load=-0.05)
    bench["shutdown"] = Shutdown.OVERLOAD
    bench.run(20.0, 0.0)
    assert bench.speed[0] == pytest.approx((0.05 - AX.friction) / AX.viscous_friction, rel=1e-6)


def test_the_output_is_free_over_the_backlash():
    # A torque of either sign brings it to the play's end and K^-1 torque further.
    ends = []
    for load in (0.02, -0.02):
        # Friction that holds the rotor when the output strikes it.
        bench = Bench(replace(AX, friction=0.5), load=load)
        bench["shutdown"] = Shutdown.OVERLOAD
        bench.run(3.0, 0.0)
        ends.append(bench.angle[0])
    expected = AX.backlash + 2 * 0.02 / AX.gear_stiffness
    assert ends[1] - ends[0] == pytest.approx(expected, rel=1e-6)


def test_the_gears_never_pull():
    # Inside the play the torque is nothing, and outside of it only away from the rotor's side.
    bench = Bench(AX, load=0.3, inertia=5e-4)
    for k in range(2000):
        bench.load = 0.3 * math.sin(0.05 * k)
        twist = bench["angle"] - bench.angle[0]
        bench.step(0.2 * math.sin(0.01 * k))
        if abs(twist) <= AX.backlash / 2:
            assert bench["torque"] == 0.0
        else:
            assert bench["torque"] * twist >= 0.0


def test_a_steady_current_warms_as_its_closed_form_says():
    # T = Ta + R_th (i^2 R + P) (1 - exp(-t/(R_th C))) with P of the electronics, exact at each
    # step: round-off alone.
    servo = replace(AX, **NEVER)
    bench = Bench(servo, ambient=20.0)
    bench["duty"], bench["wait"] = 0.5, 1e9
    bench.run(1.0, 0.0, blocked=True)
    assert bench["speed"] == 0.0
    bench["temperature"] = 20.0
    bench.run(30.0, 0.0, blocked=True)
    loss = (0.5 * 12.0) ** 2 / servo.motor.resistance + servo.standby_current * 12.0
    final = servo.thermal_resistance * loss
    fading = math.exp(-30.0 / (servo.thermal_resistance * servo.heat_capacity))
    assert bench["temperature"] == pytest.approx(20.0 + final * (1 - fading), rel=1e-10)


def test_full_output_for_too_long_shuts_the_servo_down():
    # After overload_time at the limit without a break, to a step; then it gives nothing for good.
    bench = Bench(replace(AX, overload_time=0.5, torque_limit=0.6))
    bench.run(0.45, 2.0, blocked=True)
    bench.run(0.01, 0.0, blocked=True)
    bench.run(0.499, 2.0, blocked=True)
    assert bench["shutdown"] == Shutdown.NONE
    bench.run(0.003, 2.0, blocked=True)
    assert bench["shutdown"] == Shutdown.OVERLOAD
    bench.run(0.1, 0.0, blocked=True)
    assert (bench["duty"], bench["current"], bench["shutdown"]) == (0.0, 0.0, Shutdown.OVERLOAD)


def test_a_servo_that_is_too_hot_shuts_down():
    # At stall it loses 18 W: (70 - 25) C / 18 W by the heat alone, later by what it gives away:
    # t = -R_th C ln(1 - 45/(R_th 18 W)).
    servo = replace(AX, overload_time=1e9, heat_capacity=0.5, standby_current=0.0)
    late = -10.2 * 0.5 * math.log(1 - 45 / (10.2 * 18))
    bench = Bench(servo)
    time = 0.0
    while bench["shutdown"] == Shutdown.NONE and time < 10:
        bench.step(2.0, blocked=True)
        time += bench.dt
    assert bench["shutdown"] == Shutdown.OVERHEATING
    # It stands still but for the first 50 ms, in which it draws less than at stall.
    assert late <= time < late + 0.05


def test_the_longest_step_is_stable_and_derived_from_the_true_matrices():
    # Spectral radius of a step of symplectic Euler of joints M, rotors J, gears K, D, and the
    # motors' own damping, for random legs: at most 1 at the longest step that is allowed.
    rng = np.random.default_rng(1)
    for name in servo_names():
        servo = load_servo(name)
        motor, K = servo.motor, servo.gear_stiffness
        brake = motor.constant**2 / motor.resistance + motor.viscous
        for _ in range(20):
            root = rng.normal(size=(3, 3)) * 0.02
            M = root @ root.T + np.diag([2e-4, 1.5e-4, 1.2e-4])
            dt = longest_servo_step(servo, float(np.linalg.eigvalsh(np.linalg.inv(M)).max()))
            I, O = np.eye(3), np.zeros((3, 3))
            inverse = np.block([[np.linalg.inv(M), O], [O, I / servo.armature]])
            gears = np.block([[I, -I], [-I, I]])
            K_all = inverse @ (K * gears)
            C_all = servo.gear_damping_time * K_all
            C_all += inverse @ np.block([[O, O], [O, brake * I]])
            speed = np.eye(6) - dt * C_all
            step = np.block([[np.eye(6) - dt**2 * K_all, dt * speed], [-dt * K_all, speed]])
            assert np.abs(np.linalg.eigvals(step)).max() <= 1 + 1e-9
