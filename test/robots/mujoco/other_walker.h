// A user's walker that shares only the kinds of joints with Gymnasium's.
#pragma once

#include <string>

namespace walker::mujoco {

/// Rotated body frames, a tilted hinge, welded bodies, all kinds of shapes, joints without limits,
/// two hinges with ref != 0, actuators in another order than the joints and with different gears,
/// one of them negative, asymmetric control ranges, its own buffer sizes.
inline std::string other_walker_text() {
  return R"(
<mujoco model="other">
  <compiler angle="radian"/>
  <option timestep="0.003" integrator="RK4"/>
  <size njmax="500" nconmax="100" nstack="100000"/>
  <default>
    <joint damping="0.3" armature="0.02"/>
    <geom density="700" friction="0.8 0.1 0.1"/>
  </default>
  <worldbody>
    <body name="platform" pos="0 0 -1">
      <geom name="ground" type="plane" size="50 50 1" pos="0 0 0.9"/>
    </body>
    <body name="trunk" pos="0.1 0 1.1" euler="0 0.2 0">
      <joint name="x" type="slide" axis="0.9800665778412416 0 0.19866933079506122"/>
      <joint name="z" type="slide" axis="-0.19866933079506122 0 0.9800665778412416" ref="1.1"/>
      <joint name="pitch" type="hinge" axis="0 1 0"/>
      <geom type="box" size="0.1 0.15 0.3" pos="0 0 0.1" euler="0.1 0.2 0.3" rgba="0.1 0.2 0.3 1"/>
      <body name="head" pos="0 0 0.4" euler="0.3 0 0">
        <geom type="sphere" size="0.12" pos="0.02 0 0.1"/>
        <body name="hat" pos="0 0.05 0.2" euler="0 0.5 0.1">
          <geom type="cylinder" size="0.1 0.02"/>
        </body>
      </body>
      <body name="pelvis" pos="0 0 -0.2" euler="0 0.1 0.05">
        <body name="upper_right" pos="0 -0.1 -0.05" euler="0.1 0.3 0">
          <joint name="hip_right" axis="0.1 -2 0" pos="0 0 0.03" range="-1.2 0.9" limited="true"/>
          <geom type="capsule" fromto="0 0 0 0.05 0 -0.3" size="0.05" rgba="0.9 0.2 0.3 1"/>
          <body name="lower_right" pos="0.05 0 -0.32">
            <joint name="knee_right" axis="0 -1 0" ref="0.4" range="-1.5 0.5" limited="true"/>
            <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04"/>
            <body name="ankle" pos="0 0 -0.33">
              <body name="foot_right" pos="0.02 0 0" euler="0 -0.1 0.2">
                <joint name="ankle_right" axis="0 -1 0" pos="-0.03 0 0.02"/>
                <geom type="capsule" fromto="-0.05 0 0 0.15 0 0" size="0.05" friction="1.5 0.1 0.1"/>
              </body>
            </body>
          </body>
        </body>
      </body>
      <body name="upper_left" pos="0 0.1 -0.25">
        <joint name="hip_left" axis="0 -1 0" range="-1.2 0.9" limited="true"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.05"/>
        <body name="lower_left" pos="0 0 -0.32" quat="0.8 0 0.6 0">
          <joint name="knee_left" axis="0 1 0" ref="-0.7"/>
          <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.04"/>
          <body name="foot_left" pos="0 0 -0.3">
            <joint name="ankle_left" axis="0 -1 0" pos="0 0 0.04" range="-0.5 0.5" limited="true"/>
            <geom type="capsule" fromto="-0.05 0 0 0.15 0 0" size="0.05"/>
            <body name="toe" pos="0.2 0 0">
              <geom type="sphere" size="0.03"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="a" joint="knee_left" gear="-30" ctrllimited="true" ctrlrange="-1 1"/>
    <motor name="b" joint="hip_right" gear="50" ctrllimited="true" ctrlrange="-0.4 1.2"/>
    <motor name="c" joint="ankle_left" gear="10" ctrllimited="true" ctrlrange="-2 -1"/>
    <motor name="d" joint="hip_left" gear="50" ctrllimited="true" ctrlrange="-1 1"/>
    <general name="e" joint="knee_right" gear="4" gainprm="5" ctrllimited="true" ctrlrange="-1 1"/>
    <motor name="f" joint="ankle_right" gear="7" ctrllimited="true" ctrlrange="-1 1"/>
  </actuator>
</mujoco>
)";
}

}  // namespace walker::mujoco
