"""A quadruped whose legs end in balls, as an MJCF file."""

from itertools import product

BALL = '<geom type="sphere" size="{radius}" pos="0 0 -0.2"/>'

LEG = """
<body name="{n}h" pos="{x} {y} 0"><inertial mass="0.7" pos="0 0 0" diaginertia="8e-4 6e-4 5e-4"/>
<joint name="{n}1" axis="1 0 0" range="-0.8 0.8"/><body name="{n}t" pos="0 {a} 0">
<inertial mass="1.0" pos="0 {b} -.03" diaginertia="5e-3 5e-3 1e-3"/>
<joint name="{n}2" axis="0 1 0" range="-1.04 4.19"/><body name="{n}c" pos="0 0 -0.2">
<inertial mass="0.23" pos="0 0 -.13" diaginertia="3e-3 3e-3 4e-5"/>
<joint name="{n}3" axis="0 1 0" range="-2.7 -0.92"/>{foot}</body></body></body>"""


def ball_dog(folder, radius=0.02, foot=BALL):
    """Write the file; links of 200 mm.

    Args:
        folder: Where it goes.
        radius: Of the balls [m].
        foot: What ends each shank, in its frame.
    """
    legs = ""
    for end, side in product("FR", "RL"):
        s = 1 if side == "L" else -1
        x, y = 0.183 if end == "F" else -0.183, 0.047 * s
        shape = foot.format(radius=radius)
        legs += LEG.format(n=f"{end}{side}", x=x, y=y, a=0.085 * s, b=-0.022 * s, foot=shape)
    motors = "".join(
        f'<motor joint="{end}{side}{k}" ctrlrange="-33.5 33.5"/>'
        for end, side, k in product("FR", "RL", "123")
    )
    path = folder / "dog.xml"
    path.write_text(
        '<mujoco model="dog"><compiler angle="radian" autolimits="true"/><worldbody>'
        '<body name="trunk" pos="0 0 .43"><freejoint/>'
        '<inertial mass="4.713" pos="0 .004 0" diaginertia=".016 .038 .046"/>'
        f'<geom type="box" size=".125 .04 .057"/>{legs}</body></worldbody>'
        f"<actuator>{motors}</actuator></mujoco>"
    )
    return path
