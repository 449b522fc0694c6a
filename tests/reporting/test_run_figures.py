"""Figures beyond the paper's say the right numbers, in units, for one run and for several."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from phasmid import kinematics, sense
from phasmid.errors import InvalidInput
from phasmid.recording import CHANNELS
from phasmid.reporting import CATALOGUE, figures, plot, print_summary, read_run, summarise
from phasmid.reporting.numbers import joint_power
from phasmid.reporting.path_figures import (
    beyond,
    feet_in_body,
    ideal_limits,
    motor_limits,
    servo_limits,
)
from phasmid.reporting.time_figures import LEAST_LOAD, friction_demand
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario
from phasmid.servo.law import SERVO_STATE, servo_parameters
from phasmid.servo.law_kernels import servo_step

NAMES = ("right front", "right middle", "right rear", "left rear", "left middle", "left front")
DRAWN = [name for name in CATALOGUE if name not in ("walk", "fig13", "fig14", "fig15", "fig16")]
"""Figures that are none of a drawing of their own, or of another with fewer legs."""

SERVO = {"servo_duty": 0.5, "servo_current": 0.4, "servo_temperature": 30.0}


def given(recording, **channels):
    """The recording with other numbers in some channels; a number alone stands for all of them."""
    sizes = dict(recording.sizes) | {"joint": 3, "axis": 3}
    changed = {}
    for name, values in channels.items():
        dims = CHANNELS[name].dims
        shape = tuple(sizes[dim] for dim in dims)
        changed[name] = (dims, np.broadcast_to(values, shape).copy())
    return recording.assign(changed)


@pytest.fixture(scope="module")
def full_walk(walk):
    """Two cycles with every channel that a figure draws."""
    recording = walk(duration=4.0, interval=0.05)
    measured = {
        "joint_position_measured": recording["joint_position"].values,
        "foot_normal_force_measured": recording["foot_normal_force"].values,
    }
    return given(recording, **SERVO, **measured)


def words(figure):
    from matplotlib.text import Text

    return " | ".join(text.get_text() for text in figure.findobj(Text))


def bars(axis):
    """Beginnings and ends of the bars of each collection."""
    return [
        [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in found.get_paths()]
        for found in axis.collections
    ]


@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize(
    ("count", "page"),
    [(1, {}), (2, {"width": 0.085})],
)
def test_every_axis_has_a_unit_and_no_text_leaves_its_figure(full_walk, name, count, page):
    from matplotlib.text import Text

    if count > 1 and not CATALOGUE[name].several:
        pytest.skip("shows one run")
    runs = [full_walk, given(full_walk, joint_torque=0.1)][:count]
    figure = plot(runs, name, labels=["first", "second"][:count], **page)
    figure.canvas.draw()
    shown = [axis for axis in figure.axes if axis.get_visible()]
    # Panels of a row or of a column may share a label: its first, or its last, has it.
    for axis in shown:
        place = axis.get_subplotspec()
        if place.is_first_col() and name != "gait-diagram":
            assert "[" in axis.get_ylabel()
        if place.is_last_row():
            assert "[" in axis.get_xlabel()
    # Matplotlib keeps labels of ticks that it does not show.
    ticks = {id(label) for a in shown for label in (*a.get_xticklabels(), *a.get_yticklabels())}
    for text in figure.findobj(Text):
        box = text.get_window_extent()
        if text.get_text() and text.axes in (None, *shown) and id(text) not in ticks:
            assert box.x0 >= figure.bbox.x0 - 1
            assert box.x1 <= figure.bbox.x1 + 1
            assert box.y0 >= figure.bbox.y0 - 1
            assert box.y1 <= figure.bbox.y1 + 1
            # Print shows letters of 5 pt and more.
            assert text.get_fontsize() >= 5.0
    # No legend lies on a panel.
    for legend in figure.legends:
        tops = [axis.get_window_extent().y1 for axis in shown]
        assert legend.get_window_extent().y0 >= max(tops)


def test_the_gait_diagram_shows_stance_and_contact_where_they_are(walk):
    recording = walk(duration=4.0, interval=0.01)
    contact = recording["contact"].values.copy()
    # Leg 2 stands during the first and the third second; it is seen to lift half a second early.
    contact[50:100, 1] = False
    figure = plot(given(recording, contact=contact), "gait-diagram")
    axis = figure.axes[0]
    planned, seen = bars(axis)[:6], bars(axis)[6:]
    # The last sample begins another stance of leg 2.
    np.testing.assert_allclose(planned[1][:2], [(0.0, 1.0), (2.0, 3.0)], atol=0.011)
    np.testing.assert_allclose(seen[1][:2], [(0.0, 0.5), (2.0, 3.0)], atol=0.011)
    np.testing.assert_allclose(planned[0], [(1.0, 2.0), (3.0, 4.0)], atol=0.011)
    labels = [label.get_text() for label in axis.get_yticklabels()]
    assert labels == [f"{k} {name}" for k, name in enumerate(NAMES, 1)]
    # Half a second of six times four differs.
    assert f"contact {100 * (1 - 0.5 / 24):.1f} % as planned" in words(figure)


def test_the_support_margin_is_the_distance_to_the_hull_of_the_standing_feet(short_walk):
    source = read_run(short_walk)
    axis = plot(short_walk, "support-margin").axes[0]
    seen = axis.lines[0].get_ydata()
    angles, body = short_walk["joint_position"].values, short_walk["body_position"].values
    # The walk goes straight ahead with the body level.
    com = body + kinematics.centre_of_mass(source.robot, angles)
    for row in range(0, len(seen), 37):
        standing = short_walk["contact"].values[row]
        feet = short_walk["foot_position"].values[row, standing, :2]
        hull = ConvexHull(feet)
        depth = -(hull.equations[:, :2] @ com[row, :2] + hull.equations[:, 2])
        assert seen[row] == pytest.approx(1000 * depth.min(), abs=1e-6)
    assert "of the centre of mass" in words(axis.figure)
    least = 1000 * summarise(short_walk)["support"]["least_margin"]
    assert min(axis.lines[1].get_ydata()) == pytest.approx(least, abs=1e-9)
    assert f"least {least:.1f} mm" in words(axis.figure)
    assert "while three feet stand" not in words(axis.figure)


def test_where_fewer_than_three_feet_stand_there_is_no_margin(short_walk):
    contact = short_walk["contact"].values.copy()
    contact[100:150] = False
    contact[100:150, :2] = True
    figure = plot(given(short_walk, contact=contact), "support-margin")
    line = figure.axes[0].lines[0].get_ydata()
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(line)), np.arange(100, 150))
    assert "shaded: fewer than three feet" in words(figure)
    assert "while three feet stand" in words(figure)
    assert "shaded" not in words(plot(short_walk, "support-margin"))


@pytest.mark.parametrize("speed", [-4.0, -1.0, 1.0, 4.0])
@pytest.mark.parametrize("side", [-1, 1])
def test_the_envelope_is_what_the_servos_simulation_gives_at_steady_speed(speed, side):
    """A joint is turned at constant speed while its servo pushes with all it has. In a steady state
    the rotor turns with it and the gears' torque is constant: k i - w's friction, from `servo_step`
    and not from the figure."""
    servo, dt, voltage = load_robot("phantomx-paper").servo, 1e-4, 9.0
    parameters = servo_parameters(servo.at(voltage), dt)
    servos, applied, delayed = np.zeros(1, SERVO_STATE), np.zeros(1), np.zeros((1, 0))
    servos["speed"] = speed
    limits, angle, turn = np.array([[-1e3], [1e3]]), np.zeros(1), np.array([speed])
    for _ in range(10_000):
        angle += dt * speed
        target = angle + side
        servo_step(target, angle, turn, limits, parameters, servos, delayed, applied)
    assert servos["duty"][0] == side
    limit = motor_limits(servo.motor, voltage, servo.at(voltage).stall_torque, np.array([speed]))[
        0 if side < 0 else 1
    ]
    # Twist and speed have settled: what moves them falls by e in milliseconds.
    assert applied[0] == pytest.approx(limit[0], rel=1e-4)


def test_the_envelope_meets_the_data_sheet_and_mirrors_itself():
    servo = load_robot("phantomx-paper").servo
    motor, voltage = servo.motor, servo.rated_voltage
    tiny = np.nextafter(0.0, 1.0)
    speed = np.array([tiny, servo.no_load_speed, 0.0, -2.0, 2.0])
    low, high = motor_limits(motor, voltage, servo.stall_torque, speed)
    assert high[0] == pytest.approx(servo.stall_torque, rel=1e-12)
    assert high[1] == pytest.approx(0.0, abs=1e-12)
    # At standstill and when pushed back its friction helps, up to the stall torque.
    assert high[2] == high[3] == servo.stall_torque
    # A third of the output lifts less than a third of that and holds k i (1 + c1) + c0.
    third = motor_limits(motor, voltage / 3, servo.stall_torque, speed)[1]
    push = motor.constant * voltage / 3 / motor.resistance
    assert third[0] < servo.stall_torque / 3
    assert third[2] == pytest.approx(push * (1 + motor.load_loss) + motor.coulomb, rel=1e-12)
    np.testing.assert_allclose(low[[2, 3, 4]], -high[[2, 4, 3]], rtol=1e-15)
    low, high = ideal_limits(servo.stall_torque, servo.no_load_speed, speed)
    np.testing.assert_allclose(high[[0, 1, 3]], [servo.stall_torque, 0.0, servo.stall_torque])


def test_the_envelope_takes_the_voltage_of_servos_that_drive_the_walk(walk):
    def words_of(**fields):
        scenario = load_scenario("paper").replace(**fields)
        return servo_limits(read_run(walk(duration=1.0, interval=0.05, scenario=scenario)))[1]

    assert words_of() == "limit at 12 V"
    assert words_of(drive="servo", voltage=9) == "limit at 9 V"
    assert words_of(drive="servo", torque_limit=0.5) == "limit at 12 V, 50 % output"
    assert words_of(drive="ideal-servo") == "line from stall to no-load speed"


def test_samples_beyond_the_envelope_are_counted_and_never_left_out(walk, monkeypatch):
    recording = walk(duration=4.0, interval=0.01)
    tau = np.zeros((401, 6, 3))
    tau[124, 4, 1] = 9.0
    recording = given(recording, joint_torque=tau)
    assert np.argwhere(beyond(read_run(recording), tau, np.zeros_like(tau))).tolist() == [
        [124, 4, 1]
    ]
    monkeypatch.setattr("phasmid.reporting.path_figures.MOST_MARKS", 10)
    figure = plot(recording, "servo-envelope")
    marks = figure.axes[1].lines[4].get_ydata()
    assert len(marks) == 11
    assert 9.0 in marks
    assert f"{100 / tau.size:.2g} % of samples beyond it" in words(figure)


def test_friction_demand_is_tangential_over_normal_force_in_loaded_stances(short_walk):
    stance, normal = short_walk["stance"].values, short_walk["foot_normal_force"].values
    force = short_walk["foot_force"].values.copy()
    force[..., 0], force[..., 1] = 0.3 * normal, 0.4 * normal
    light = LEAST_LOAD * read_run(short_walk).weight * 0.99
    normal = normal.copy()
    normal[20:30] = light
    force[20:30] = [1.0, 0.0, light]
    recording = given(short_walk, foot_force=force, foot_normal_force=normal)
    figure = plot(recording, "friction-demand")
    expected = np.where(stance, 0.5, np.nan)
    expected[20:30] = np.nan
    for leg, axis in enumerate(figure.axes):
        np.testing.assert_allclose(axis.lines[0].get_ydata(), expected[:, leg], rtol=1e-12)
        assert set(axis.lines[1].get_ydata()) == {0.7}
        assert axis.get_title(loc="left") == f"Leg {leg + 1}, {NAMES[leg]}"
    assert "stances under at least 0.52 N" in words(figure)


def test_the_coefficient_of_friction_is_that_of_the_ground_under_the_foot(walk):
    # The feet of the left side, y > 0, stand on ice.
    scenario = load_scenario("paper").replace(patches=[[-5, 5, 0, 5, 0.2]])
    recording = walk(duration=2.0, interval=0.05, scenario=scenario)
    assert (friction_demand(read_run(recording))[1] == [0.7] * 3 + [0.2] * 3).all()


def test_foot_paths_in_the_body_do_not_depend_on_where_the_body_goes(short_walk):
    expected = short_walk["foot_position"].values - short_walk["body_position"].values[:, None]
    yaw, away = 0.8, np.array([1.0, -2.0, 0.3])
    c, s = math.cos(yaw), math.sin(yaw)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = given(
        short_walk,
        foot_position=short_walk["foot_position"].values @ R.T + away,
        body_position=short_walk["body_position"].values @ R.T + away,
        body_orientation=np.array([math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]),
    )
    np.testing.assert_allclose(feet_in_body(read_run(moved)), expected, atol=1e-14)
    above, world, side, _ = plot(moved, "foot-path").axes
    for leg in range(6):
        line = np.array(above.lines[leg].get_data()).T
        np.testing.assert_allclose(line, 1000 * expected[:, leg, :2], atol=1e-10)
        line = np.array(side.lines[leg].get_data()).T
        np.testing.assert_allclose(line, 1000 * expected[:, leg, ::2], atol=1e-10)
        line = np.array(world.lines[leg].get_data()).T
        np.testing.assert_allclose(line, 1000 * moved["foot_position"].values[:, leg, :2])
    assert "1 right front" in words(above.figure)


def test_power_is_torque_times_speed_and_energy_its_integral(walk):
    """Nine joints give 54 W with 2 N·m at 3 rad/s; nine others brake with 1 N·m."""
    tau = np.full((401, 6, 3), 2.0)
    tau[:, 3:] = -1.0
    recording = given(
        walk(duration=4.0, interval=0.01),
        joint_torque=tau,
        joint_velocity=3.0,
        servo_friction_torque=-0.25,
        servo_speed=2.0,
        **SERVO,
    )
    figure = plot(recording, "power")
    above, below = figure.axes
    # Of 0.5 of 12 V at 0.4 A each of 18 servos takes 2.4 W; friction takes 0.5 W of its rotor.
    for number, power in enumerate((54.0, 9.0, 43.2)):
        np.testing.assert_allclose(above.lines[number].get_ydata(), power, rtol=1e-12)
        time, energy = below.lines[number].get_data()
        np.testing.assert_allclose(energy, power * time, atol=1e-9)
    assert (above.get_ylabel(), below.get_ylabel()) == ("power [W]", "energy [J]")
    told = summarise(recording)
    assert below.lines[0].get_ydata()[-1] == pytest.approx(told["energy"]["work"], rel=1e-12)
    assert told["energy"]["friction_work"] == pytest.approx(9.0 * 4, rel=1e-12)
    assert told["energy"]["electrical_power"] == pytest.approx(43.2, rel=1e-12)
    assert told["energy"]["electrical_energy"] == pytest.approx(43.2 * 4, rel=1e-12)
    cost = told["energy"]["cost_of_transport"]
    assert cost == pytest.approx(54 * 4 / (26 * told["travel"]["distance"]), rel=1e-9)
    assert f"cost of transport {cost:.2f} (mechanical)" in words(figure)
    text = io.StringIO()
    print_summary(told, file=text)
    for line in (
        f"mechanical cost of transport {cost:.3g}",
        "Servo friction 36 J lost in motors and gears",
        "Electrical 173 J, 43.2 W drawn by the motors",
    ):
        assert line in " ".join(text.getvalue().split())
    # Without a rotor of its own the servo turns as the joint does.
    bare = given(recording.drop_vars("servo_speed"), servo_friction_torque=-0.25)
    np.testing.assert_allclose(joint_power(read_run(bare))["friction"], 13.5, rtol=1e-12)
    # A supply that would be fed counts nothing.
    fed = given(recording, servo_duty=-0.5)
    assert (joint_power(read_run(fed))["electrical"] == 0).all()


def test_runs_are_compared_line_by_line_and_told_apart_by_their_labels(walk):
    runs = [walk(duration=4.0, interval=0.01)]
    other = load_scenario("paper").replace(step_length_mm=60, voltage=9)
    robot = replace(load_robot("phantomx-paper"), name="my-robot")
    runs.append(walk(duration=6.0, interval=0.01, scenario=other, robot=robot))
    figure = plot(runs, "joint-torque", legs=(2, 5), labels=["a", "b"])
    assert len(figure.axes) == 6
    for row, leg in enumerate((1, 4)):
        for joint in range(3):
            axis = figure.axes[3 * row + joint]
            for run, line in zip(runs, axis.lines, strict=True):
                # Only the time that both have is shown.
                torque = run["joint_torque"].values[:401, leg, joint]
                np.testing.assert_array_equal(line.get_ydata(), torque)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["a", "b"]
    assert "Leg 2, right middle: coxa" in words(figure)
    unnamed = plot([runs[0], *runs], "joint-torque", legs=(2,)).legends[0].get_texts()
    assert [text.get_text() for text in unnamed] == [
        "phantomx-paper · tripod gait, run 1",
        "phantomx-paper · tripod gait, run 2",
        "my-robot · tripod gait",
    ]
    looks = {(line.get_color(), line.get_linestyle()) for line in figure.axes[0].lines}
    assert len({colour for colour, _ in looks}) == 2
    assert len({dash for _, dash in looks}) == 2
    with pytest.raises(InvalidInput, match="7 runs were given; a figure shows 1 to 6"):
        plot(runs[:1] * 7, "power")


@pytest.mark.parametrize(
    ("name", "drop", "error", "hint"),
    [
        ("gait-diagram", ("stance", "contact"), "stance or contact", "from its plan"),
        ("foot-path", ("foot_position",), "foot_position", "simulate"),
        ("servo-current", (), "servo_current", "--drive servo"),
        ("sensors", (), "joint_position_measured", "--measured everything"),
    ],
)
def test_a_figure_says_which_channel_is_lacking_and_how_to_get_it(walk, name, drop, error, hint):
    recording = walk(duration=1.0, interval=0.05, drop=drop)
    with pytest.raises(InvalidInput, match=f"has no {error}") as refused:
        plot(recording, name)
    assert f"the figure {name} needs it." in str(refused.value)
    assert hint in refused.value.hint


def test_told_is_drawn_over_true_in_degrees(short_walk):
    told = sense(load_scenario("paper"), short_walk)
    assert "sensors" not in figures(short_walk)
    axes = figures(told)["sensors"].axes
    # The synthetic walk knows no angular velocity, so that there is no inertial sensor.
    assert [axis.get_ylabel() for axis in axes] == ["femur [°]", "femur load [1]", "foot [N]"]
    true_line, told_line = plot(told, "sensors").axes[0].lines
    last = told.isel(time=slice(200, None))
    angle = np.degrees(last.joint_position.values[:, 0, 1])
    assert np.allclose(true_line.get_ydata(), angle, atol=1e-12)
    angle = np.degrees(last.joint_position_measured.values[:, 0, 1])
    assert np.allclose(told_line.get_ydata(), angle, atol=1e-12)


def test_an_analysis_has_figures_of_what_the_model_computes(walk):
    drop = ("joint_torque", "joint_velocity", "joint_position", "contact", "foot_force")
    recording = walk(duration=2.0, interval=0.05, drop=drop)
    assert "by the model" in words(plot(recording, "servo-envelope"))
    assert "by the model" in words(plot(recording, "power"))
    assert "of the model" in words(plot(recording, "friction-demand"))
    assert "recorded contact" not in words(plot(recording, "gait-diagram"))
    without = walk(duration=2.0, interval=0.05, drop=("body_orientation",))
    assert "of the body's origin" in words(plot(without, "support-margin"))
