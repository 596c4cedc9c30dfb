"""Inputs of the rules: scene files of LabBuilder, and layouts of labgym."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from labgym.documents import read_json
from labgym.envs.tasks import each_layout
from labgym.paper.labbuilder.frame import to_scene
from labgym.paper.labbuilder.routes import PAIRS_FILE, read_goals
from labgym.paper.labbuilder.scene import read_scene
from labgym.paper.labbuilder_rules.library import Library
from labgym.paper.labbuilder_rules.navigation import goal_places
from labgym.paper.labbuilder_rules.quirks import LITERAL
from labgym.paper.labbuilder_rules.stage import RatedScene, Stage, layout_scene, scene_of


def rated_scenes(names: Sequence[str], library: Library) -> Iterator[tuple[str, RatedScene]]:
    """Yield what names stand for, with its name: files of scenes, and layouts as `labgym score` takes them.

    Raises:
        DocumentError: a file is broken.
        LabgymError: a layout is not one rectangular room.
    """
    for name in names:
        if is_scene(Path(name)):
            yield name, scene_from_file(Path(name), library)
        else:
            for layout in each_layout([name]):
                yield layout.id, layout_scene(layout, library)


def is_scene(path: Path) -> bool:
    """Return whether a file is a scene of LabBuilder."""
    if path.suffix != ".json" or not path.is_file():
        return False
    data = read_json(path)
    return isinstance(data, dict) and "schema" not in data and isinstance(data.get("objects"), list)


def scene_from_file(path: Path, library: Library) -> RatedScene:
    """Return the scene of a file, with the places that the goal_pairs.json next to it leads to.

    Raises:
        DocumentError: a file is broken; names the field.
    """
    scene = scene_of(read_scene(path).scene)
    poses = read_goals(path.with_name(PAIRS_FILE), path.stem)
    goals = [to_scene(pose.x, pose.y, 0.0)[:2] for pose in poses]
    return replace(scene, places=goal_places(scene, Stage(scene, library, LITERAL), goals))
