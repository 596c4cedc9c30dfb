"""Replays in 3D: shapes, scenes and what moves, against meshes, layouts and a drive of the simulator."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess

import numpy as np
import pytest

from labgym.assets.shapes import MATERIALS
from labgym.envs.labnav.episodes import published_episodes
from labgym.envs.labnav.nuisances import prepared
from labgym.envs.robot_mesh import robot_mesh
from labgym.errors import LabgymError
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.replay import drive_again, things_along
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.reports.site.replays import Replay, shape_data, write_replays
from labgym.scenes.mesh import MATERIAL_NAMES


def decoded(shape):
    """Return color, opacity and triangles (m, 3, 3) of each part."""
    low, step = np.array(shape["low"]), np.array(shape["step"])
    for color, opacity, vertices, faces in shape["parts"]:
        places = np.frombuffer(base64.b64decode(vertices), "<u2").reshape(-1, 3)
        kind = "<u2" if len(places) <= 65_536 else "<u4"
        index = np.frombuffer(base64.b64decode(faces), kind).reshape(-1, 3)
        yield color, opacity, (low + step * places)[index]


def read(path, name):
    text = (path / f"{name}.js").read_text()
    begin = f"labgymReplay({json.dumps(name)},"
    assert text.startswith(begin)
    assert text.endswith(");\n")
    return json.loads(text[len(begin) : -3])


@pytest.fixture(scope="module")
def moved():
    part = published_episodes("moved", 2)
    return part, part.episodes[0]


@pytest.fixture(scope="module")
def task(moved):
    part, episode = moved
    return prepared(part.task, part.level, episode, part.layout(episode.floor))


@pytest.fixture(scope="module")
def folder(task, tmp_path_factory):
    return write_replays([Replay(task), Replay(task)], tmp_path_factory.mktemp("page") / "replays")


def test_a_shape_has_the_triangles_and_colors_of_its_mesh():
    mesh = robot_mesh()
    parts = list(decoded(shape_data(mesh.vertices, mesh.faces, mesh.material)))
    triangles = np.concatenate([part for _, _, part in parts])
    assert len(triangles) == len(mesh.faces)
    assert len({(color, opacity) for color, opacity, _ in parts}) == len(parts)
    looks = {name: tuple(MATERIALS[name].rgba) for name in MATERIAL_NAMES}
    for color, opacity, part in parts:
        own = [
            k
            for k, index in enumerate(mesh.material)
            if "#" + "".join(f"{round(255 * c):02x}" for c in looks[MATERIAL_NAMES[index]][:3]) == color
            and round(looks[MATERIAL_NAMES[index]][3], 2) == opacity
        ]
        assert np.abs(part - mesh.vertices[mesh.faces[own]]).max() < 1e-4


def test_a_large_building_stays_within_a_millimeter():
    vertices = np.array([[0.0, 0.0, 0.0], [42.5, 0.0, 0.0], [42.5, 31.7, 3.1], [0.0, 31.7, 3.1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    ((_, _, triangles),) = decoded(shape_data(vertices, faces, np.zeros(2, dtype=np.int64)))
    assert np.abs(triangles - vertices[faces]).max() < 0.001


def test_the_scene_has_every_placement_once_and_episodes_share_their_shapes(folder, task):
    first, second = (read(folder, f"episodes/{number}") for number in range(2))
    assert first == second
    poses = {each[-1]: each[1:5] for each in (*first["placed"], *first["things"])}
    assert poses.keys() == {placement.id for placement in task.layout.placements}
    for placement in task.layout.placements:
        assert poses[placement.id] == pytest.approx([*placement.position, placement.yaw], abs=1e-4)
    assert {each[-1] for each in first["things"]} == set(task.pushable)
    used = {first["building"], first["robot"], *first["people"], *(e[0] for e in (*first["placed"], *first["things"]))}
    assert {f"shapes/{path.stem}" for path in (folder / "shapes").iterdir()} == used
    assert len(used) < len(poses)


def test_a_beaker_is_on_the_robot_in_the_drives_that_carry_it(folder, tmp_path):
    assert read(folder, "episodes/0")["payload"] is None
    for name in ("carry", "shift"):
        part = published_episodes(name, 2)
        episode = part.episodes[0]
        task = prepared(part.task, part.level, episode, part.layout(episode.floor))
        place = write_replays([Replay(task)], tmp_path / name)
        payload = read(place, "episodes/0")["payload"]
        assert payload["legs"] == (task.conditions["payload"]["legs"] if name == "shift" else None)
        heights = np.concatenate([part[..., 2].ravel() for _, _, part in decoded(read(place, payload["shape"]))])
        assert 0.1 < heights.min() < heights.max() < 0.8


def test_replays_are_small(folder):
    sizes = {path.name: path.stat().st_size for path in folder.rglob("*.js")}
    assert sizes["three.min.js"] < 700_000
    assert sum(sizes.values()) < 8_000_000
    assert (folder / "three.LICENSE.txt").read_text().startswith("The MIT License")


def test_a_folder_of_something_else_is_not_replaced(task, tmp_path):
    (tmp_path / "replays").mkdir()
    (tmp_path / "replays" / "mine.txt").write_text("mine")
    with pytest.raises(LabgymError, match="is not a folder of replays"):
        write_replays([Replay(task)], tmp_path / "replays")


def test_things_are_where_the_simulator_had_them(moved, tmp_path):
    part, episode = moved
    suite = LabNavSuite("labnav-moved-2", (part.only({f"moved-2/{episode.key}"}),))
    evaluation = evaluate("straight", suite, out=tmp_path / "run")
    moves = things_along(evaluation, suite, evaluation.rows[0].key)
    shots = drive_again("straight", part, episode).shots
    places = np.cumsum(np.array(moves.places).reshape(-1, 3 * len(moves.names)), axis=0) / 100.0
    every = round(moves.dt / 0.1)
    assert len(places) == len(shots[::every])
    for place, shot in zip(places, shots[::every], strict=True):
        poses = sorted(body.pose for body in shot.bodies)
        assert np.abs(np.array(sorted(map(tuple, place.reshape(-1, 3)))) - np.array(poses)).max() <= 0.005 + 1e-9


@pytest.mark.skipif(shutil.which("node") is None, reason="needs Node.js")
def test_the_scripts_parse(folder):
    for path in (*sorted(folder.rglob("*.js"))[:5], folder / "three.min.js"):
        subprocess.run(["node", "--check", str(path)], check=True, capture_output=True)
