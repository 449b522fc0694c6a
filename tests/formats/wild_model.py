"""An MJCF model with all that other people's models have: defaults, frames, files, odd joints."""

import trimesh

WILD = """<mujoco model="wild">
  <compiler angle="degree" eulerseq="XYZ" meshdir="assets"/>
  <default>
    <default class="leg"><joint damping="0.1" armature="0.01" range="-40 50" axis="0 1 0"/>
      <geom density="800" rgba="0.2 0.3 0.4 1"/></default>
    <default class="visual">
      <geom type="mesh" contype="0" conaffinity="0" group="1" mass="0"/></default>
  </default>
  <asset><mesh name="plate" file="plate.stl" scale="0.001 0.001 -0.001"/>
    <material name="red" rgba="0.8 0.1 0.1 1"/></asset>
  <worldbody>
    <light pos="0 0 3"/><geom type="plane" size="1 1 1"/>
    <body name="crate" pos="2 0 0"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <frame euler="10 20 30" pos="0 0 0.3">
      <body name="hull" pos="0 0 0.1" childclass="leg">
        <freejoint/>
        <geom class="visual" mesh="plate" material="red"/>
        <geom type="ellipsoid" size=".1 .08 .05" mass="2"/>
        <body name="thigh" pos=".1 .05 0" euler="0 30 45">
          <joint name="hip" pos="0.01 0.02 -0.03" ref="15"/>
          <geom type="capsule" fromto="0 0 0 .1 0 -.02" size=".015"/>
          <body pos=".1 0 0" axisangle="1 1 0 60">
            <joint name="abduct" axis="1 0 0.5" range="-20 20"/>
            <joint name="knee" pos="-.02 .01 0" axis="0 2 0" frictionloss="0.2"/>
            <geom type="capsule" fromto="0 0 0 0 0 -.12" size=".01"/>
            <site name="toe_1" pos="0 0 -.13" euler="0 90 0"/><site name="camera_mount"/>
          </body>
        </body>
        <body name="mast" pos="0 0 .1">
          <geom type="cylinder" fromto="0 0 0 0 0 .2" size=".01"/>
        </body>
      </body>
    </frame>
  </worldbody>
  <actuator>
    <position class="leg" joint="hip" kp="20" forcerange="-3 4"/>
    <motor joint="knee" gear="5" ctrlrange="-.5 .5"/>
    <general joint="abduct" dyntype="integrator" gainprm="2" biastype="affine" biasprm="0 -2 0"/>
  </actuator>
  <equality><joint joint1="hip" joint2="knee" active="false"/></equality>
  <tendon><fixed name="t"><joint joint="hip" coef="1"/></fixed></tendon>
</mujoco>"""

BESIDE = {"assets/plate.stl": trimesh.creation.box((200.0, 100.0, 20.0)).export(file_type="stl")}
"""Files beside it, by name."""
