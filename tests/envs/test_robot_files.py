"""Robots from MJCF files: those with the documented names drive, everything else is refused in one line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv
from labgym.envs.mount import on_floor
from labgym.envs.parts.mjcf import MjcfRobot
from labgym.envs.scene_simulation import SceneSimulation
from labgym.errors import DocumentError, LabgymError
from labgym.layouts import Layout

WHEELED = """<mujoco model="bot">
  <worldbody>
    <light pos="0 0 3"/>
    <body name="base">
      <freejoint/>
      <geom type="box" size="0.15 0.12 0.05" pos="0 0 0.11" mass="8"/>
      <geom type="sphere" size="0.03" pos="-0.12 0 0.03" mass="0.2" friction="0.02 0.005 0.0001" priority="1"/>
      <geom type="sphere" size="0.03" pos="0.12 0 0.031" mass="0.2" friction="0.02 0.005 0.0001" priority="1"/>
      <body name="left" pos="0 0.15 0.06">
        <joint name="left_wheel" axis="0 1 0" armature="0.005"/>
        <geom type="ellipsoid" size="0.06 0.02 0.06" mass="0.5"/>
      </body>
      <body name="right" pos="0 -0.15 0.06">
        <joint name="right_wheel" axis="0 1 0" armature="0.005"/>
        <geom type="ellipsoid" size="0.06 0.02 0.06" mass="0.5"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <velocity name="left_wheel" joint="left_wheel" kv="2" forcerange="-3 3"/>
    <velocity name="right_wheel" joint="right_wheel" kv="2" forcerange="-3 3"/>
  </actuator>
</mujoco>"""

PLANAR = """<mujoco model="disc">
  <asset><mesh name="hull" file="hull.obj"/></asset>
  <worldbody>
    <body name="base">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="yaw" axis="0 0 1"/>
      <geom type="mesh" mesh="hull" mass="20"/>
      <site name="center"/>
    </body>
  </worldbody>
  <actuator>
    <velocity name="forward" site="center" gear="1 0 0 0 0 0" kv="400" ctrlrange="-0.2 0.8"/>
    <velocity name="sideways" site="center" gear="0 1 0 0 0 0" kv="400" ctrlrange="-0.4 0.4"/>
    <velocity name="turn" site="center" gear="0 0 0 0 0 1" kv="20" ctrlrange="-1 1"/>
  </actuator>
</mujoco>"""

CUBE = "\n".join(
    [
        *(f"v {x} {y} {z}" for x in (-0.15, 0.15) for y in (-0.1, 0.1) for z in (0.05, 0.4)),
        *("f " + face for face in ("1 2 4", "1 4 3", "5 7 8", "5 8 6", "1 5 6", "1 6 2", "3 4 8", "3 8 7")),
        *("f " + face for face in ("1 3 7", "1 7 5", "2 6 8", "2 8 4")),
    ]
)


def written(folder: Path, text: str) -> Path:
    (folder / "hull.obj").write_text(CUBE)
    path = folder / "robot.xml"
    path.write_text(text)
    return path


def test_a_file_with_two_wheels_drives_at_the_commanded_velocities(tmp_path: Path) -> None:
    robot = MjcfRobot(written(tmp_path, WHEELED), {"v_max": 0.6, "w_max": 1.2})  # type: ignore[arg-type]
    assert robot.axes == ("forward", "turn")
    assert robot.controls((0.3, 0.0)) == pytest.approx((0.3 / 0.06, 0.3 / 0.06))
    assert robot.controls((0.0, 1.0)) == pytest.approx((-0.15 / 0.06, 0.15 / 0.06))
    # The farthest points: the ends of a wheel, and the corner of the box.
    assert robot.size.chassis_radius == pytest.approx(math.hypot(0.15, 0.12), abs=0.01)
    assert robot.size.height == pytest.approx(0.16)
    assert robot.size.mass == pytest.approx(9.4)
    simulation = SceneSimulation(on_floor(robot), robot, 0.1)
    for _ in range(20):
        simulation.drive(0.4, 0.5)
    assert simulation.velocity == pytest.approx((0.4, 0.5), rel=0.05)


def test_a_planar_file_with_a_mesh_has_the_limits_of_its_actuators(tmp_path: Path) -> None:
    robot = MjcfRobot(written(tmp_path, PLANAR))
    size = robot.size
    assert robot.axes == ("forward", "sideways", "turn")
    assert (size.v_min, size.v_max, size.v_side, size.w_max) == (-0.2, 0.8, 0.4, 1.0)
    assert size.chassis_radius == pytest.approx(math.hypot(0.15, 0.1), abs=1e-6)
    assert size.height == pytest.approx(0.4, abs=1e-6)
    assert robot == MjcfRobot(written(tmp_path, PLANAR))
    assert hash(robot) == hash(MjcfRobot(written(tmp_path, PLANAR)))


def test_an_environment_drives_a_robot_from_a_file(tmp_path: Path, layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout, robot={"kind": "mjcf", "path": str(written(tmp_path, PLANAR))})
    env.reset(seed=0, options={"start": (4.0, 4.8, 0.0), "goal": (5.5, 4.8)})
    for _ in range(10):
        info = env.step(np.array([0.5, 0.0, 0.0], np.float32))[4]
    assert info["pose"][0] == pytest.approx(4.0 + 0.4 * 1.0, abs=0.06)
    assert not info["collision"]


def changed(old: str, new: str, text: str = WHEELED) -> str:
    assert old in text
    return text.replace(old, new, 1)


BAD = {
    "entities": changed("<mujoco", '<!DOCTYPE mujoco [<!ENTITY a "b">]><mujoco'),
    "an include": changed("<worldbody>", '<include file="other.xml"/><worldbody>'),
    "a plugin": changed("<worldbody>", '<extension><plugin plugin="mujoco.pid"/></extension><worldbody>'),
    "a plugin actuator": changed("<actuator>", '<actuator><plugin joint="left_wheel" plugin="mujoco.pid"/>'),
    "another model": changed("<worldbody>", '<asset><model name="a" file="a.xml"/></asset><worldbody>'),
    "a flexible body": changed("<freejoint/>", '<freejoint/><flexcomp name="f" type="grid"/>'),
    "a replica": changed("<freejoint/>", '<freejoint/><replicate count="99999"><geom size="1"/></replicate>'),
    "a height field": changed("<worldbody>", '<asset><hfield name="h" file="h.png"/></asset><worldbody>'),
    "a floor": changed("<light", '<geom type="plane" size="1 1 1"/><light'),
    "two bodies": changed("<light", '<body name="other"><geom size="0.1"/></body><light'),
    "another body": changed('name="base"', 'name="chassis"'),
    "a mesh outside": changed("hull.obj", "../hull.obj", PLANAR),
    "an absolute path": changed("hull.obj", "/etc/hostname", PLANAR),
    "a mesh that is none": changed("hull.obj", "robot.xml", PLANAR),
    "a folder outside": changed("<asset>", '<compiler meshdir="/etc"/><asset>', PLANAR),
    "a missing mesh": changed("hull.obj", "absent.obj", PLANAR),
    "no XML": "not XML",
    "another root": "<robot/>",
    "no actuator": changed('<velocity name="left_wheel"', '<velocity name="other"'),
    "wheels swapped": WHEELED.replace("left_wheel", "x_wheel")
    .replace("right_wheel", "left_wheel")
    .replace("x_wheel", "right_wheel"),
    "a robot too wide": changed('size="0.15 0.12 0.05"', 'size="0.5 0.12 0.05"'),
    "a robot too high": changed('size="0.15 0.12 0.05" pos="0 0 0.11"', 'size="0.15 0.12 0.8" pos="0 0 0.9"'),
    "a robot that falls": changed('pos="0 0 0.11"', 'pos="0.2 0 0.11"').replace("0.12 0 0.031", "0.02 0 0.031"),
    "a motor instead of a velocity servo": changed('kv="2"', 'kv="0"').replace('kv="2"', 'kv="0"'),
    "nonsense numbers": changed('size="0.15 0.12 0.05"', 'size="a b c"'),
    "too many geoms": changed("<freejoint/>", "<freejoint/>" + '<geom size="0.01"/>' * 1001),
    "deep nesting": changed("<freejoint/>", "<freejoint/>" + "<body>" * 70 + "</body>" * 70),
}


@pytest.mark.parametrize("name", BAD)
def test_files_that_are_no_robot_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(LabgymError) as caught:
        MjcfRobot(written(tmp_path, BAD[name]))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_links_out_of_the_folder_large_files_and_folders_are_refused(tmp_path: Path) -> None:
    inside = tmp_path / "robot"
    inside.mkdir()
    (tmp_path / "secret.obj").write_text(CUBE)
    (inside / "link.obj").symlink_to(tmp_path / "secret.obj")
    with pytest.raises(DocumentError, match="not in the folder"):
        MjcfRobot(written(inside, changed("hull.obj", "link.obj", PLANAR)))
    large = tmp_path / "large.xml"
    large.write_text(changed("<light", "<!--" + " " * 2**21 + "--><light"))
    with pytest.raises(DocumentError, match="larger than 2 MB"):
        MjcfRobot(large)
    with pytest.raises(DocumentError, match="is no file"):
        MjcfRobot(tmp_path)


def test_unknown_limits_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LabgymError, match="chassis_radius"):
        MjcfRobot(written(tmp_path, WHEELED), {"chassis_radius": 0.1})  # type: ignore[arg-type]
