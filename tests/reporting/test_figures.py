"""Figures name what they show, keep its extremes, and come out the same each time."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.reporting import draw_robot, figures, plot, walk_picture
from phasmid.reporting.renderer import Lack
from phasmid.reporting.style import save_figure
from phasmid.robot import load_robot

PAPER = {f"fig{number}" for number in range(12, 17)}


def words(figure):
    """All text of a figure."""
    from matplotlib.text import Text

    return " | ".join(text.get_text() for text in figure.findobj(Text))


@pytest.fixture
def without_opengl(monkeypatch):
    monkeypatch.setattr("phasmid.reporting.drawing.opengl_lack", lambda: Lack("OpenGL", ""))


def test_figures_say_what_they_show_and_in_which_unit(short_walk):
    found = figures(short_walk)
    for name, title, unit in (
        ("fig12", "Joint angles of legs 1, 2 and 3", "angle [°]"),
        ("fig13", "Joint torques of legs 1, 2 and 3", "torque [N·m]"),
        ("fig14", "Joint torques of legs 4, 5 and 6", "torque [N·m]"),
        ("fig15", "Normal forces of legs 1, 2 and 3", "force [N]"),
        ("fig16", "Normal forces of legs 4, 5 and 6", "force [N]"),
    ):
        text = words(found[name])
        for piece in (title, unit, "time [s]", "phantomx-paper", "tripod gait", "servo AX-12A"):
            assert piece in text
        assert "prescribed drive" in text
        # What the model assumes says nothing of angles.
        assert ("minimum-norm" in text) == (name != "fig12")
    assert "weight 26 N" in words(found["fig15"])


def test_angles_are_drawn_in_degrees(short_walk):
    planned = short_walk["joint_position_target"].values
    seen = planned + 0.01
    recording = short_walk.assign(joint_position=(short_walk["joint_position"].dims, seen))
    figure = plot(recording, "joint-angle", legs=(2, 5))
    # Each joint's plan lies dashed on what was seen.
    _, _, coxa, others = figure.axes
    for axis, number, joint, angles in (
        (coxa, 0, 0, seen),
        (others, 1, 2, seen),
        (others, 3, 2, planned),
    ):
        line = axis.lines[number]
        expected = np.degrees(angles[:, 4, joint])
        np.testing.assert_allclose(line.get_ydata(), expected, rtol=1e-14)
        assert line.is_dashed() == (angles is planned)
    assert "planned" in words(figure)
    assert "simulated" in words(figure)


@pytest.mark.parametrize("name", ["long-name-" * 6, "machine of the institute", "a $x^ <b>"])
def test_no_name_leaves_its_figure_or_is_taken_for_a_formula(walk, tmp_path, name):
    from matplotlib.text import Text

    robot = replace(load_robot("phantomx-paper"), name=name)
    recording = walk(duration=30.0, interval=0.05, robot=robot)
    figure = plot(recording, "normal-force", legs=(1, 2))
    figure.canvas.draw()
    for text in figure.findobj(Text):
        if text.get_text() and text.get_visible():
            assert text.get_window_extent().x1 <= figure.bbox.x1
            assert text.get_window_extent().y1 <= figure.bbox.y1
    flat = words(figure).replace("\n", "")
    assert name[:55].replace(" ", "") in flat.replace(" ", "")
    save_figure(figure, tmp_path / "a.svg")
    text = "".join(ET.parse(tmp_path / "a.svg").getroot().itertext())
    assert name[:5] in text


def test_of_a_long_walk_the_last_cycles_are_drawn(walk):
    recording = walk(duration=24.0, interval=0.05)
    figure = plot(recording, "joint-torque", legs=(1,))
    assert "last 5 of 12 cycles" in words(figure)
    # A cycle is 2 s.
    assert figure.axes[0].get_xlim() == pytest.approx((14.0, 24.0), abs=1e-9)
    assert recording.sizes["time"] == 481
    six = plot(walk(duration=12.0, interval=0.05), "joint-torque", legs=(1,))
    assert "cycles" not in words(six)
    assert six.axes[0].get_xlim() == pytest.approx((0.0, 12.0), abs=1e-9)


def test_an_analysis_gives_the_models_figures(walk):
    seen = ("joint_position", "joint_torque", "foot_normal_force")
    found = figures(walk(duration=2.0, interval=0.05, kind="model", drop=seen))
    assert set(found) == PAPER
    assert "Planned joint angles" in words(found["fig12"])
    assert "simulated" not in words(found["fig13"])


def test_figures_without_their_channel_are_left_out(walk):
    forces = ("foot_normal_force", "foot_normal_force_model")
    recording = walk(duration=2.0, interval=0.05, drop=forces)
    assert set(figures(recording)) == PAPER - {"fig15", "fig16"}
    with pytest.raises(InvalidInput, match="has no foot_normal_force"):
        plot(recording, "normal-force", legs=(1,))
    with pytest.raises(InvalidInput, match="there is no leg 7; legs are 1 to 6"):
        plot(recording, "joint-torque", legs=(7,))


def test_more_legs_give_more_files_of_a_kind(walk, eight_legs):
    robot, scenario = eight_legs
    found = figures(walk(duration=2.0, interval=0.05, robot=robot, scenario=scenario))
    assert set(found) == PAPER | {"fig12b", "fig12c", "fig14b", "fig16b"}
    assert "legs 7 and 8" in words(found["fig14b"])


def test_without_opengl_the_picture_is_a_stick_figure_on_its_feet(
    short_walk, tmp_path, monkeypatch, without_opengl
):
    from matplotlib.colors import to_hex
    from matplotlib.patches import Circle

    from phasmid.reporting.style import leg_colour

    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 60)
    figure = walk_picture(short_walk)
    picture, diagram = figure.axes
    assert not picture.images
    assert "tripod gait" in words(figure)
    assert len(diagram.collections) == 12
    # Each leg is a line from its hip to its foot, where the dot of its force is.
    links = [line for line in picture.lines if line.get_marker() == "o"]
    assert [to_hex(line.get_color()) for line in links] == [leg_colour(leg) for leg in range(6)]
    ends = {tuple(np.round(line.get_xydata()[-1], 6)) for line in links}
    dots = [patch for patch in picture.patches if isinstance(patch, Circle)]
    assert len(dots) == 3
    assert {tuple(np.round(dot.center, 6)) for dot in dots} <= ends
    save_figure(figure, tmp_path / "walk.png")


def test_the_picture_tells_how_a_run_ended_early(short_walk, monkeypatch):
    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 60)
    half = short_walk.sel(time=slice(0, 2.5))
    assert "fell at 2.50 s" in words(walk_picture(half.assign_attrs(ending="FELL")))
    assert " at 2.50 s" not in words(walk_picture(half.assign_attrs(ending="COMPLETED")))


def test_the_picture_tells_every_standing_foots_force(short_walk, monkeypatch):
    from matplotlib.patches import FancyArrow

    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 60)
    # At 1.5 s legs 1, 3 and 5 bear a third of 26 N each.
    figure = draw_robot(short_walk, 1.5)
    axis = figure.axes[0]
    assert [text.get_text() for text in axis.texts].count("8.67 N") == 3
    assert "at most 8.67 N" in words(figure)
    arrows = [patch for patch in axis.patches if isinstance(patch, FancyArrow)]
    assert len(arrows) == 3
    # They lie over the image, so that no leg can hide them.
    others = [*axis.images, *axis.lines]
    assert min(arrow.get_zorder() for arrow in arrows) > max(one.get_zorder() for one in others)
