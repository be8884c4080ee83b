"""A small URDF to be changed by tests: an arm with a shoulder, a slide, a tool plate and a finger off the chain."""

from __future__ import annotations

ARM = """<?xml version="1.0"?>
<robot name="crane">
  <link name="world"/>
  <link name="base"><inertial><mass value="9"/><origin xyz="0 0 0.1"/></inertial></link>
  <link name="mast">
    <inertial>
      <mass value="2"/><origin xyz="0.1 0 0"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"/>
    </inertial>
    <collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision>
  </link>
  <link name="bolted"><inertial><mass value="1"/><origin xyz="0 0 0.5"/></inertial></link>
  <link name="jib"><collision><geometry><sphere radius="0.06"/></geometry></collision></link>
  <link name="plate"/>
  <link name="tool0"/>
  <link name="finger"><inertial><mass value="0.5"/></inertial></link>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 1"/></joint>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="mast"/><origin xyz="0 0 0.5"/><axis xyz="0 0 2"/>
    <limit lower="-2" upper="2.5" velocity="1.5" effort="40"/><dynamics damping="0.7" friction="0.2"/>
  </joint>
  <joint name="bolts" type="fixed"><parent link="mast"/><child link="bolted"/><origin xyz="0.3 0 0"/></joint>
  <joint name="slide" type="prismatic">
    <parent link="bolted"/><child link="jib"/><origin xyz="0 0.1 0" rpy="0 0 1.5707963267948966"/><axis xyz="1 0 0"/>
    <limit lower="0.1" upper="0.8" velocity="0.5" effort="300"/>
  </joint>
  <joint name="screws" type="fixed"><parent link="jib"/><child link="plate"/><origin xyz="0 0 0.2"/></joint>
  <joint name="flange" type="fixed">
    <parent link="plate"/><child link="tool0"/><origin rpy="3.141592653589793 0 0"/>
  </joint>
  <joint name="grip" type="revolute">
    <parent link="plate"/><child link="finger"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/>
  </joint>
</robot>
"""
