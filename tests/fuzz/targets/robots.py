"""Robots from MJCF files, with their meshes and textures."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from random import Random

from fuzz.mutation import mutated_bytes, mutated_file
from fuzz.target import Case, Target
from labgym.envs.parts.mjcf import MjcfRobot

ROBOT = """<mujoco model="bot">
  <compiler angle="radian" meshdir="."/>
  <default><geom condim="3"/><default class="wheel"><geom friction="1 0.01 0.001"/></default></default>
  <asset>
    <texture name="paint" type="2d" file="paint.png"/>
    <texture name="sky" type="cube" builtin="gradient" width="16" height="96"/>
    <material name="paint" texture="paint"/>
    <mesh name="hull" file="hull.obj" scale="1 1 1"/>
    <mesh name="cap" file="cap.stl" maxhullvert="20"/>
    <mesh name="knob" builtin="supersphere" params="8 1 1" scale="0.02 0.02 0.02"/>
  </asset>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="base">
      <freejoint/>
      <geom type="mesh" mesh="hull" pos="0 0 0.11" mass="8" material="paint"/>
      <geom type="mesh" mesh="cap" pos="0 0 0.16" mass="0.1" contype="0" conaffinity="0"/>
      <geom type="mesh" mesh="knob" pos="0 0 0.18" mass="0.1"/>
      <geom type="sphere" size="0.03" pos="-0.12 0 0.03" mass="0.2" friction="0.02 0.005 0.0001" priority="1"/>
      <geom type="sphere" size="0.03" pos="0.12 0 0.031" mass="0.2" friction="0.02 0.005 0.0001" priority="1"/>
      <site name="top" pos="0 0 0.2"/>
      <camera name="eye" pos="0.1 0 0.15" resolution="64 36"/>
      <body name="left" pos="0 0.15 0.06">
        <joint name="left_wheel" axis="0 1 0" armature="0.005"/>
        <geom class="wheel" type="ellipsoid" size="0.06 0.02 0.06" mass="0.5"/>
      </body>
      <body name="right" pos="0 -0.15 0.06">
        <joint name="right_wheel" axis="0 1 0" armature="0.005"/>
        <geom class="wheel" type="ellipsoid" size="0.06 0.02 0.06" mass="0.5"/>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="left" body2="right"/></contact>
  <actuator>
    <velocity name="left_wheel" joint="left_wheel" kv="2" forcerange="-3 3"/>
    <velocity name="right_wheel" joint="right_wheel" kv="2" forcerange="-3 3"/>
  </actuator>
</mujoco>"""
CORNERS = [(x, y, z) for x in (-0.15, 0.15) for y in (-0.12, 0.12) for z in (-0.05, 0.05)]
FACES = ("124", "143", "578", "586", "156", "162", "348", "387", "137", "175", "268", "284")
HUGE = ("30000", "1e9", "-1", "0", "nan", "inf", "1e-300", "99999999999", "1 " * 5000, "2147483648", "", "a")
EXTRA = (
    '<texture name="t#" builtin="checker" width="4000" height="4000"/>',
    '<mesh name="m#" builtin="cone" params="150 1"/>',
    '<mesh name="m#" builtin="supersphere" params="100 1 1"/>',
    '<body pos="0 0 0.1"><joint type="ball"/><geom size="0.05" mass="0.1"/></body>',
    '<geom size="0.02" pos="0 0 0.1#"/>',
    '<motor name="a#" joint="left_wheel"/>',
    '<general name="g#" joint="left_wheel" dyntype="integrator" actdim="3"/>',
    '<exclude name="e#" body1="left" body2="right"/>',
    '<frame pos="0 0 0.#"><geom size="0.01"/></frame>',
    '<default class="c#"><geom size="1"/></default>',
)


def targets() -> Iterator[Target]:
    """Yield a target for the text and one for its files."""
    yield Target("robot mjcf", lambda: partial(_robot, True), _load)
    yield Target("robot files", lambda: partial(_robot, False), _load)


def _robot(text: bool, rng: Random | None) -> Case:
    files = {"robot.xml": ROBOT.encode(), "hull.obj": _obj(), "cap.stl": _stl(), "paint.png": _png()}
    if rng is None:
        return files
    if text:
        files["robot.xml"] = _changed(rng)
    else:
        name = rng.choice(("hull.obj", "cap.stl", "paint.png"))
        change = mutated_file if name == "hull.obj" and rng.random() < 0.7 else None
        files[name] = change(rng, files[name].decode()) if change else mutated_bytes(rng, files[name])
        if name == "paint.png" and rng.random() < 0.3:
            files[name] = _png(rng.choice((1, 8, 3000, 60_000)), rng.choice((1, 8, 5000)), rng.choice((0, 100, 2**24)))
    return files


def _changed(rng: Random) -> bytes:
    """Return the text with a value replaced, elements repeated, or changed as text."""
    values = list(re.finditer(r'"([^"]*)"', ROBOT))
    match rng.randrange(4):
        case 0:
            text = ROBOT
            for value in sorted(rng.sample(values, rng.choice((1, 2, 4))), key=lambda each: -each.start()):
                text = text[: value.start(1)] + rng.choice(HUGE) + text[value.end(1) :]
            return text.encode()
        case 1:
            places = [each.end() for each in re.finditer(r"<(asset|actuator|contact|freejoint/|default)>?", ROBOT)]
            at = rng.choice(places)
            at = ROBOT.index(">", at - 1) + 1
            count = rng.choice((1, 5, 90, 150, 3000))
            return (
                ROBOT[:at] + "".join(rng.choice(EXTRA).replace("#", str(k)) for k in range(count)) + ROBOT[at:]
            ).encode()
        case 2:
            value = rng.choice(values)
            name = rng.choice(("nsample", "delay", "octree_maxdepth", "user", "plugin", "class", "margin", "inertia"))
            return (ROBOT[: value.end()] + f' {name}="{rng.choice(HUGE)}"' + ROBOT[value.end() :]).encode()
        case _:
            return mutated_file(rng, ROBOT)


def _obj() -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS] + ["f " + " ".join(face) for face in FACES]
    return "\n".join(lines).encode()


def _stl() -> bytes:
    faces = [[CORNERS[int(corner) - 1] for corner in face] for face in FACES]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *(0.3 * x for corner in face for x in corner), 0) for face in faces)
    return bytes(80) + struct.pack("<I", len(faces)) + body


def _png(width: int = 8, height: int = 8, more: int = 0) -> bytes:
    """Return a picture; `more` bytes are appended to its rows."""

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    rows = zlib.compress((b"\0" + b"\x80" * 24) * 8 + bytes(more))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def _load(folder: Path) -> None:
    """Make the robot, as an environment does."""
    MjcfRobot(folder / "robot.xml")
