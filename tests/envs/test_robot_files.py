"""Robots from MJCF files: those with the documented names drive, everything else is refused in one line."""

from __future__ import annotations

import json
import math
import os
import resource
import struct
import zlib
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


def png(width: int, height: int, raw: bytes, more: bytes = b"") -> bytes:
    """A picture of 8-bit RGB with compressed rows, and chunks before them."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + more + chunk(b"IDAT", raw) + chunk(b"IEND", b"")


def chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def rows(width: int, height: int) -> bytes:
    return zlib.compress((b"\0" + b"\x80" * 3 * width) * height)


def assets(text: str) -> str:
    return changed("<worldbody>", f"<asset>{text}</asset><worldbody>")


def inside(text: str, robot: str = WHEELED) -> str:
    return changed("<freejoint/>", "<freejoint/>" + text, robot)


def after(section: str, text: str) -> str:
    return changed("<actuator>", f"<{section}>{text}</{section}><actuator>")


def each(count: int, text: str) -> str:
    return "".join(text.replace("#", str(k)) for k in range(count))


BUILTIN = '<texture name="t#" builtin="checker" type="2d" width="WIDE" height="WIDE"/>'
LINK = '<body pos="0 0 0.1"><joint axis="0 0 1"/>SHAPES</body>'
BALL = '<geom type="sphere" size="0.05" mass="0.01"/>'
HEAVY = {
    "textures in sum": assets(each(100, BUILTIN.replace("WIDE", "2000"))),
    "textures of six sides": assets(each(2, '<texture name="t#" builtin="flat" width="1500" height="1"/>')),
    "a texture too wide": assets('<texture name="t" builtin="flat" type="2d" width="9999" height="1"/>'),
    "a texture in exponents": assets('<texture name="t" builtin="flat" type="2d" width="9e9" height="9"/>'),
    "a texture of two widths": assets('<texture name="t" builtin="flat" type="2d" width="8 8" height="8"/>'),
    "a texture of no width": assets('<texture name="t" builtin="flat" type="2d" width="" height="8"/>'),
    "a cone": assets('<mesh name="m" builtin="cone" params="200000000 1"/>'),
    "a supersphere": assets('<mesh name="m" builtin="supersphere" params="30000 1 1"/>'),
    "a wedge": assets('<mesh name="m" builtin="wedge" params="30000 30000 90 90 0"/>'),
    "a plate": assets('<mesh name="m" builtin="plate" params="30000 30000"/>'),
    "a torus": assets('<mesh name="m" builtin="supertorus" params="3000 0.5 1 1"/>'),
    "meshes in sum": assets(each(150, '<mesh name="m#" builtin="supersphere" params="100 1 1"/>')),
    "parameters that are no numbers": assets('<mesh name="m" builtin="plate" params="1e400 nan"/>'),
    "vertices in the text": assets(f'<mesh name="m" vertex="{"0 0 0 " * 330_000}"/>') + " " * 10,
    "an octree": assets('<mesh name="m" builtin="sphere" params="3" octree_maxdepth="30"/>'),
    "attributes": inside("<geom " + each(100_000, 'a#="1" ') + "/>"),
    "materials": assets(each(9000, '<material name="m#"/>')),
    "default classes": changed(
        "<worldbody>", "<default>" + each(300, "<default class='c#'/>") + "</default><worldbody>"
    ),
    "frames": inside(each(3000, "<frame/>")),
    "exclusions": after("contact", each(4000, '<exclude name="e#" body1="left" body2="right"/>')),
    "equalities": after("equality", each(4000, '<connect name="e#" body1="left" body2="right" anchor="0 0 0"/>')),
    "tendons": after("tendon", each(150, '<fixed name="e#"><joint joint="left_wheel" coef="1"/></fixed>')),
    "actuators": changed("</actuator>", each(4000, '<motor name="m#" joint="left_wheel"/>') + "</actuator>"),
    "a history": changed('kv="2"', 'kv="2" delay="1" nsample="1000000000"'),
    "states of an actuator": changed("</actuator>", '<general joint="left_wheel" actdim="2000000000"/></actuator>'),
    "parts that overlap": inside(each(150, LINK.replace("SHAPES", BALL))),
    "many parts that overlap": inside(each(190, LINK.replace("SHAPES", BALL * 5))),
    "margins without end": inside('<geom type="sphere" size="0.01" margin="1e300" gap="1e300"/>'),
    "parts that collapse": inside(
        each(150, '<body pos="0 0 0.1#"><joint type="slide" axis="0 0 1"/><geom size="0.0004" mass="0.01"/></body>')
    ),
}
FILES = {
    "a picture that unpacks without end": ("a.png", lambda: png(8, 8, zlib.compress(bytes(2**28)))),
    "a text that unpacks without end": (
        "a.png",
        lambda: png(8, 8, rows(8, 8), chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(2**28)))),
    ),
    "a picture of too many pixels": ("a.png", lambda: png(60_000, 60_000, rows(8, 8))),
    "a picture that is cut off": ("a.png", lambda: png(8, 8, rows(8, 8))[:-20]),
    "a face with many corners": ("a.obj", lambda: CUBE.encode() + b"\nf" + b" 1" * 200_000),
    "many faces": ("a.obj", lambda: CUBE.encode() + b"\nf 1 2 4" * 900_000),
}


@pytest.mark.cases(12)
@pytest.mark.parametrize("name", [*HEAVY, *FILES])
def test_robots_that_take_memory_or_time_in_sum_are_refused_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    """Oracle: the kernel's counters of a separate process; MuJoCo took 0.6 to 7 GB or 6 to 40 s before the limits."""
    monkeypatch.chdir(tmp_path)
    if name in FILES:
        file, content = FILES[name]
        (tmp_path / file).write_bytes(content())
        element = "texture type='2d'" if file.endswith("png") else "mesh"
        text = assets(f"<{element} name='m' file='{file}'/>")
    else:
        text = HEAVY[name]
    message, megabytes, seconds = measured(written(tmp_path, text))
    if name == "a text that unpacks without end":
        assert message == ""  # such chunks are left out
    else:
        assert message.startswith(("DocumentError", "OptionError"))
    assert len(message.splitlines()) <= 1
    assert len(message) < 700
    assert megabytes < 700
    assert seconds < 20
    assert capfd.readouterr().err == ""
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def measured(path: Path) -> tuple[str, float, float]:
    """Load a robot in a fork; return its error, and the memory in MB and processor time that it took."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
        resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
        before, message = peak(), ""
        try:
            MjcfRobot(path)
        except BaseException as error:  # noqa: BLE001 - it is compared
            message = f"{type(error).__name__}: {error}"
        os.write(writing, json.dumps([message, peak() - before]).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as stream:
        answer = stream.read()
    _, status, usage = os.wait4(child, 0)
    assert status == 0
    message, megabytes = json.loads(answer)
    return message, megabytes, usage.ru_utime + usage.ru_stime


def peak() -> float:
    """Peak of the resident memory of this process, MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def test_pictures_and_built_in_shapes_of_usual_size_are_kept(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png(300, 200, rows(300, 200), chunk(b"tEXt", b"a\0b")))
    text = assets(
        '<texture name="p" type="2d" file="a.png"/>'
        '<texture name="c" builtin="checker" type="2d" width="512" height="64"/>'
        '<mesh name="m" builtin="supersphere" params="30 1 1" scale="0.05 0.05 0.05"/>'
    )
    model = MjcfRobot(written(tmp_path, text)).spec().compile()
    assert model.tex_width.tolist() == [300, 512]
    assert model.tex_height.tolist() == [200, 64]
    assert model.tex_data[: 300 * 200 * 3].tolist() == [0x80] * (300 * 200 * 3)
    assert model.nmesh == 1


def test_unknown_limits_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LabgymError, match="chassis_radius"):
        MjcfRobot(written(tmp_path, WHEELED), {"chassis_radius": 0.1})  # type: ignore[arg-type]
