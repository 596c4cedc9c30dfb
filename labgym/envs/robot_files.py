"""Robots from MJCF files: bounded in all sums, checked against a list of elements, compiled without other files.

A file from outside is data. It may name meshes and textures in its own folder; it may not include other files, load
plugins or refer to anything outside of that folder.
"""

from __future__ import annotations

import os
import sys
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import mujoco

from labgym.confinement.trial import TrialError, answer_of
from labgym.envs.robot_limits import MAX_PIXELS, MAX_VERTICES, check_counts, pixels, plain_png, vertices
from labgym.errors import DocumentError

MAX_BYTES = 2 * 2**20
"""Largest size of the MJCF file, bytes."""
MAX_ASSET_BYTES, MAX_ASSETS_BYTES = 16 * 2**20, 64 * 2**20
"""Largest size of one mesh or texture, and of all, bytes."""
COMPILER_BYTES, COMPILER_SECONDS = 2**30, 60.0
"""Memory and time that MuJoCo may take to compile a robot."""
MAX_DEPTH = 64
"""Deepest nesting of elements."""
SUFFIXES = {"mesh": (".stl", ".obj", ".msh"), "texture": (".png",)}
"""Kinds of files that an element may name."""

TREE = {"body", "inertial", "joint", "freejoint", "geom", "site", "camera", "light", "frame"}
ACTUATORS = {"general", "motor", "position", "velocity", "intvelocity", "damper"}
CHILDREN: dict[str, set[str]] = {
    "mujoco": {
        "compiler", "option", "size", "visual", "statistic", "default", "asset", "worldbody", "contact", "equality",
        "tendon", "actuator", "sensor", "keyframe", "custom",
    },
    "compiler": {"lengthrange"},
    "option": {"flag"},
    "visual": {"global", "quality", "headlight", "map", "scale", "rgba"},
    "default": {
        "default", "mesh", "material", "joint", "geom", "site", "camera", "light", "pair", "equality", "tendon",
        *ACTUATORS,
    },
    "asset": {"mesh", "texture", "material"},
    "worldbody": TREE,
    "body": TREE,
    "frame": TREE,
    "contact": {"pair", "exclude"},
    "equality": {"connect", "weld", "joint", "tendon"},
    "tendon": {"fixed", "spatial"},
    "fixed": {"joint"},
    "spatial": {"site", "geom", "pulley"},
    "actuator": ACTUATORS,
    "keyframe": {"key"},
}  # fmt: skip
"""Elements that may stand in an element; all others have none."""
DROPPED = ("option", "size", "visual", "statistic", "sensor", "keyframe", "custom")
"""Sections that say nothing about the robot, or that a scene does not take from it, and are left out."""
SUMS = {"mesh": ("vertices", MAX_VERTICES), "texture": ("pixels", MAX_PIXELS)}
"""Unit and limit of the sum over all elements of a kind."""
FAULTS = (ValueError, RuntimeError, MemoryError, mujoco.FatalError)
"""Errors of MuJoCo's reader and compiler."""
FOLDERS = ("meshdir", "texturedir", "assetdir")


@dataclass(frozen=True)
class RobotFile:
    """An MJCF file that passed the checks, with the files that it names.

    Attributes:
        path: the file. xml: its text, whose meshes and textures have the names of `assets`.
        assets: contents of meshes and textures by name, sorted.
    """

    path: Path
    xml: str
    assets: tuple[tuple[str, bytes], ...]

    def spec(self) -> mujoco.MjSpec:
        """Return the specification.

        Raises:
            DocumentError: MuJoCo refuses it.
        """
        with quiet():
            try:
                return mujoco.MjSpec.from_string(self.xml, assets=dict(self.assets))
            except FAULTS as error:
                raise DocumentError(self.path, "", f"MuJoCo refuses it ({_reason(error)})") from None

    def compile(self) -> mujoco.MjModel:
        """Return the compiled robot without a scene, once a confined process has compiled it within limits.

        Raises:
            DocumentError: MuJoCo refuses it, crashes, or exceeds a limit.
        """
        _try_out(self)
        return self.compiled()

    def compiled(self) -> mujoco.MjModel:
        """Return the compiled robot without a scene, without limits.

        Raises:
            DocumentError: MuJoCo refuses it.
        """
        spec = self.spec()
        with quiet():
            try:
                return spec.compile()
            except FAULTS as error:
                raise DocumentError(self.path, "", f"MuJoCo cannot compile it ({_reason(error)})") from None


@lru_cache(maxsize=8)
def _try_out(file: RobotFile) -> None:
    """Compile a robot in a confined process, which answers with plain data; an error is not kept.

    Raises:
        DocumentError: MuJoCo refuses it, crashes, or exceeds a limit.
    """

    def work() -> str:
        try:
            file.compiled()
        except DocumentError as error:
            return str(error).removeprefix(f"{file.path}: ")
        return ""

    try:
        problem = str(answer_of(work, COMPILER_BYTES, COMPILER_SECONDS))
    except TrialError as error:
        problem = f"MuJoCo cannot compile it ({error})"
    if problem:
        raise DocumentError(file.path, "", problem)


def read_robot(path: str | Path) -> RobotFile:
    """Return an MJCF file after checking it.

    Raises:
        DocumentError: it cannot be read, is too large, is not MJCF, or has an element that is not allowed.
    """
    path = Path(path)
    root = _parsed(path, _read(path, path, MAX_BYTES, ""))
    _check_elements(path, root)
    for name in DROPPED:
        for section in root.findall(name):
            root.remove(section)
    for compiler in root.findall("compiler"):
        for section in compiler.findall("lengthrange"):
            compiler.remove(section)
    check_counts(path, root)
    _check_world(path, root)
    assets = _take_assets(path, root)
    return RobotFile(path, ET.tostring(root, encoding="unicode"), tuple(sorted(assets.items())))


@contextmanager
def quiet() -> Iterator[None]:
    """Discard the messages that MuJoCo writes to the standard error and to MUJOCO_LOG.TXT; errors are raised."""
    sys.stderr.flush()
    with open(os.devnull, "w") as nothing:  # noqa: PTH123 - a device
        stderr = os.dup(2)
        os.dup2(nothing.fileno(), 2)
        handler = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda _: None)
        try:
            yield
        finally:
            mujoco.set_mju_user_warning(handler)
            os.dup2(stderr, 2)
            os.close(stderr)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:300]


def _read(document: Path, path: Path, limit: int, field: str) -> bytes:
    """Return the bytes of a file, at most `limit`."""
    try:
        if not path.is_file():
            raise DocumentError(document, field, f"is no file: {path.name}" if field else "is no file")
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise DocumentError(document, field, f"cannot be read ({error.strerror})") from None
    if len(data) > limit:
        raise DocumentError(document, field, f"{path.name} is larger than {limit / 2**20:.0f} MB")
    return data


def _parsed(path: Path, data: bytes) -> ET.Element:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        raise DocumentError(path, "", "is not UTF-8 text") from None
    if "<!" in text.replace("<!--", ""):
        raise DocumentError(path, "", "has a document type or an entity, which robots do not need: remove it")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise DocumentError(path, "", f"is not XML ({error})") from None
    except (ValueError, RecursionError) as error:
        raise DocumentError(path, "", f"is not XML ({type(error).__name__})") from None
    if root.tag != "mujoco":
        raise DocumentError(path, "", f"is a <{str(root.tag)[:40]}>, expected <mujoco>")
    return root


def _check_elements(path: Path, root: ET.Element) -> None:
    """Check the names and the nesting of all elements, without recursion."""
    waiting = [(root, 1)]
    while waiting:
        element, depth = waiting.pop()
        if depth > MAX_DEPTH:
            raise DocumentError(path, element.tag, f"elements are nested deeper than {MAX_DEPTH}")
        if element.tag == "sensor" or element.tag == "custom":  # left out with all that is in them
            continue
        allowed = CHILDREN.get(element.tag, set())
        for child in element:
            name = str(child.tag)[:40]
            if name not in allowed:
                raise DocumentError(path, f"{element.tag}/{name}", f"<{name}> is not allowed in a robot")
            waiting.append((child, depth + 1))
        if "plugin" in element.attrib:
            raise DocumentError(path, element.tag, "plugins are not allowed in a robot")


def _check_world(path: Path, root: ET.Element) -> None:
    """Check that the world has the body `base` alone; its lights and cameras are left out."""
    worlds = root.findall("worldbody")
    if len(worlds) != 1:
        raise DocumentError(path, "worldbody", f"there are {len(worlds)}, expected one")
    for element in list(worlds[0]):
        if element.tag in ("light", "camera", "site"):
            worlds[0].remove(element)
    names = [f"{element.tag} {element.get('name', '')!r}" for element in worlds[0]]
    if names != ["body 'base'"]:
        raise DocumentError(
            path, "worldbody", f"has {', '.join(names)[:120] or 'nothing'}, expected the body 'base' alone"
        )


def _take_assets(path: Path, root: ET.Element) -> dict[str, bytes]:
    """Read the files that elements name, rename them, and return their contents by name."""
    folders: dict[str, str] = {}
    for compiler in root.findall("compiler"):
        for name in FOLDERS:
            folders[name] = compiler.attrib.pop(name, folders.get(name, ""))
        compiler.attrib.pop("strippath", None)
    assets: dict[str, bytes] = {}
    sums: Counter[str] = Counter()
    for element in root.iter():
        for name in element.attrib:
            if name.startswith("file") and (element.tag not in SUFFIXES or name != "file"):
                raise DocumentError(path, f"{element.tag}/{name}", "only <mesh> and <texture> may name a file")
        file = element.get("file")
        if file is None:
            if element.tag in SUMS:
                _add(path, sums, element, "", b"")
            continue
        folder = folders.get(f"{element.tag}dir", "") or folders.get("assetdir", "")
        source = _inside(path, element.tag, folder, file)
        data = _read(path, source, MAX_ASSET_BYTES, f"{element.tag}/file")
        sums["bytes"] += len(data)
        if sums["bytes"] > MAX_ASSETS_BYTES:
            raise DocumentError(path, element.tag, f"files take more than {MAX_ASSETS_BYTES / 2**20:.0f} MB")
        data = _add(path, sums, element, source.suffix.lower(), data)
        if "name" not in element.attrib:
            element.set("name", source.stem)
        own = f"{element.tag}_{len(assets)}{source.suffix.lower()}"
        element.set("file", own)
        assets[own] = data
    return assets


def _add(path: Path, sums: Counter[str], element: ET.Element, suffix: str, data: bytes) -> bytes:
    """Add what a mesh or a texture takes to the sums, check them, and return its file as it is passed to MuJoCo."""
    unit, limit = SUMS[element.tag]
    if element.tag == "mesh":
        sums[unit] += vertices(path, element, suffix, data)
    elif suffix:
        data, size = plain_png(path, data)
        sums[unit] += pixels(path, element, size)
    else:
        sums[unit] += pixels(path, element)
    if sums[unit] > limit:
        raise DocumentError(path, element.tag, f"all together have more than {limit} {unit}")
    return data


def _inside(path: Path, tag: str, folder: str, file: str) -> Path:
    """Return the path of a file that an element names, which must be in the folder of the document."""
    home = path.resolve().parent
    try:
        source = (home / folder / file).resolve()
        inside = source.is_relative_to(home)
    except (OSError, ValueError, RuntimeError):
        inside = False
    if not inside:
        raise DocumentError(path, f"{tag}/file", f"{file[:80]!r} is not in the folder of the robot")
    if source.suffix.lower() not in SUFFIXES[tag]:
        raise DocumentError(path, f"{tag}/file", f"{file[:80]!r} is not one of {', '.join(SUFFIXES[tag])}")
    return source
