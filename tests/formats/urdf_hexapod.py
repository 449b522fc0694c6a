"""URDF of a hexapod of sticks, as people write it, with parts of its text replaced."""

import math

LEGS = {
    "right_front": (0.12, -0.06),
    "right_middle": (0.0, -0.1),
    "right_rear": (-0.12, -0.06),
    "left_rear": (-0.12, 0.06),
    "left_middle": (0.0, 0.1),
    "left_front": (0.12, 0.06),
}
LIMIT = '<limit lower="-1.57" upper="1.57" effort="2.2" velocity="6"/>'
BOX = '<box size="0.26 0.14 0.06"/>'


def _link(name, mass, length):
    across, along = mass * 4e-4 / 12, mass * (length**2 + 1e-4) / 12
    return (
        f'<link name="{name}"><inertial><origin xyz="{length / 2} 0 0"/><mass value="{mass}"/>'
        f'<inertia ixx="{across}" ixy="0" ixz="0" iyy="{along}" iyz="0" izz="{along}"/>'
        "</inertial></link>"
    )


def _joint(name, parent, child, origin, axis, limit):
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin {origin}/><axis xyz="{axis}"/>{limit}</joint>'
    )


def hexapod(limit=LIMIT, lengths=(0.05, 0.08, 0.13), turn=0.0):
    """Return the text.

    Args:
        limit: The ``<limit>`` of every joint.
        lengths: Coxa, femur and tibia [m].
        turn: Angle by which the maker's forward is turned to the left of x [rad].
    """
    coxa, femur, tibia = lengths
    text = (
        '<robot name="sticks"><link name="base_link"><inertial><mass value="1.2"/><inertia '
        'ixx="0.00232" ixy="0" ixz="0" iyy="0.00712" iyz="0" izz="0.00872"/></inertial><visual>'
        f"<geometry>{BOX}</geometry></visual></link>"
    )
    c, s = math.cos(turn), math.sin(turn)
    for name, (x, y) in LEGS.items():
        hip = f"{c * x - s * y} {s * x + c * y} 0"
        yaw = math.atan2(y, x) + turn
        parts = [f"{name}_{part}" for part in ("coxa", "femur", "tibia")]
        for part, mass, length in zip(parts, (0.06, 0.08, 0.05), lengths, strict=True):
            text += _link(part, mass, length)
        coxa_link, femur_link, tibia_link = parts
        text += _joint(
            f"{coxa_link}_joint", "base_link", coxa_link, f'xyz="{hip}" rpy="0 0 {yaw}"', "0 0 1",
            limit,
        )  # fmt: skip
        text += _joint(
            f"{femur_link}_joint", coxa_link, femur_link, f'xyz="{coxa} 0 0"', "0 1 0", limit
        )
        text += _joint(
            f"{tibia_link}_joint", femur_link, tibia_link, f'xyz="{femur} 0 0" rpy="0 1.2 0"',
            "0 1 0", limit,
        )  # fmt: skip
        text += (
            f'<link name="{name}_foot"/><joint name="{name}_foot_joint" type="fixed">'
            f'<parent link="{tibia_link}"/><child link="{name}_foot"/>'
            f'<origin xyz="{tibia} 0 0"/></joint>'
        )
    return f"{text}</robot>"


def saved(folder, text):
    path = folder / "sticks.urdf"
    path.write_text(text, encoding="utf-8")
    return path
