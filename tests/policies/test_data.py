from __future__ import annotations

import hashlib
import math
import shutil
import signal
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import shapely
from scipy.ndimage import distance_transform_edt

from labgym.cli import main
from labgym.documents import read_json, write_json
from labgym.envs.sensors import Camera
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.geometry import wrap_angle
from labgym.layouts import Layout, generate, load_published, published
from labgym.layouts.splits import TRAIN_SEEDS, manifest
from labgym.navigation import PLANNING_RADIUS, occupancy, shortest_path
from labgym.navigation.plan import OBSTACLE_HEIGHT
from labgym.policies.data import DataOptions, Dataset, DatasetManifest, load_dataset, make_dataset, shard
from labgym.policies.data.columns import depth_of, depth_png, jpeg, rgb_of
from labgym.policies.data.maps import CLEARANCE_M, cost_map, privileged_maps
from labgym.policies.data.read import pictures
from labgym.policies.data.situations import LARGEST_TURN_RAD, STRIDES_M, Situations, resampled
from labgym.runs import ExecutorOptions
from labgym.scenes import RayScene
from runs import killing

OPTIONS = DataOptions(samples=24, seed=5, shard=12, layout=6, drive=3)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    # By two workers: what one makes again below must then be the same to the byte.
    make_dataset(folder, OPTIONS, ExecutorOptions(workers=2), progress=False)
    return folder


@pytest.fixture(scope="module")
def data(dataset: Path) -> Dataset:
    return load_dataset(dataset)


@pytest.fixture(scope="module")
def layouts(dataset: Path) -> list[Layout]:
    """The dataset's layouts, generated anew from what the manifest says of them."""
    entries = [entry for each in DatasetManifest.load(dataset / "manifest.json").shards for entry in each.layouts]
    return [generate(entry.protocol, entry.seed, entry.room) for entry in entries]


def test_files_have_the_hashes_of_the_manifest(dataset: Path) -> None:
    manifest = DatasetManifest.load(dataset / "manifest.json")
    assert manifest.complete
    assert [each.samples for each in manifest.shards] == [12, 12]
    for each in manifest.shards:
        for name, digest in each.files.items():
            assert hashlib.sha256((dataset / name).read_bytes()).hexdigest() == digest


def test_layouts_are_those_of_the_manifest_and_none_is_published(dataset: Path, layouts: list[Layout]) -> None:
    entries = [entry for each in DatasetManifest.load(dataset / "manifest.json").shards for entry in each.layouts]
    held_out = {entry.hash for split in ("val", "test") for entry in manifest(split).layouts}
    assert [layout.hash for layout in layouts] == [entry.hash for entry in entries]
    assert len({entry.hash for entry in entries}) == len(entries) == 4
    assert held_out.isdisjoint(entry.hash for entry in entries)
    assert all(entry.seed < TRAIN_SEEDS for entry in entries)


def test_a_published_layout_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    held_out = load_published("test", published("test")[0])
    monkeypatch.setattr(shard, "train_layout", lambda rng: held_out)
    with pytest.raises(LabgymError, match="held out"):
        make_dataset(tmp_path, DataOptions(samples=1), progress=False)


def test_one_worker_writes_the_bytes_of_two_and_repairs_damaged_shards(dataset: Path, tmp_path: Path) -> None:
    broken = copied(dataset, tmp_path / "again")
    for name in ("manifest.json", "samples/00001.parquet"):
        (broken / name).unlink()
    (broken / "maps/00001.parquet").write_bytes(b"half a fi")
    modified = (broken / "samples/00000.parquet").stat().st_mtime_ns
    make_dataset(broken, OPTIONS, progress=False)
    assert (broken / "samples/00000.parquet").stat().st_mtime_ns == modified
    assert killing.tree(broken) == killing.tree(dataset)


def test_another_seed_needs_another_folder(dataset: Path) -> None:
    with pytest.raises(OptionError, match=r"options.*--fresh"):
        make_dataset(dataset, DataOptions(samples=24, seed=6), progress=False)


def test_an_unfinished_dataset_says_so(dataset: Path, tmp_path: Path) -> None:
    folder = copied(dataset, tmp_path / "part")
    (folder / "manifest.json").unlink()
    with pytest.raises(OptionError, match="labgym data"):
        load_dataset(folder)


def test_a_dataset_of_release_0_1_is_read_and_not_continued(dataset: Path, tmp_path: Path) -> None:
    for name in ("manifest.json", "samples/00000.parquet", "maps/00000.parquet"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes((dataset / name).read_bytes())
    document = read_json(tmp_path / "manifest.json")
    write_json(tmp_path / "manifest.json", {**document, "shards": document["shards"][:1], "complete": False})
    assert len(load_dataset(tmp_path)) == 12
    with pytest.raises(OptionError, match="--fresh"):
        make_dataset(tmp_path, OPTIONS, progress=False)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("undisturbed")
    make_dataset(folder, DataOptions(samples=6, shard=2, seed=3), progress=False)
    return killing.tree(folder)


@pytest.mark.slow
def test_a_killed_dataset_resumes_to_the_same_files(undisturbed, tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    words = ("data", "--samples", "6", "--shard", "2", "--seed", "3", "--workers", "2", "--out", str(folder))
    (seen,) = killing.check(words, folder, undisturbed, (signal.SIGKILL, killing.lines(folder / "ledger.jsonl", 1)))
    assert seen.finished >= 1


def copied(dataset: Path, folder: Path) -> Path:
    shutil.copytree(dataset, folder)
    return folder


@pytest.mark.parametrize("name", ["samples/00000.parquet", "maps/00001.parquet"])
@pytest.mark.parametrize("damage", ["swapped", "torn", "flipped", "missing"])
def test_a_file_that_is_not_what_the_manifest_records_is_refused(
    dataset: Path, tmp_path: Path, name: str, damage: str
) -> None:
    folder = copied(dataset, tmp_path / "data")
    content = bytearray((folder / name).read_bytes())
    content[len(content) // 2] ^= 1
    other = name.replace("00000", "x").replace("00001", "00000").replace("x", "00001")
    changed = {"swapped": (dataset / other).read_bytes(), "torn": content[:-100], "flipped": content, "missing": None}
    (folder / name).unlink()
    if changed[damage] is not None:
        (folder / name).write_bytes(changed[damage])
    for read in (load_dataset, lambda folder: list(pictures(folder, 24))):
        if read is load_dataset or name.startswith("samples"):
            with pytest.raises(DocumentError, match=r"parquet: (its SHA-256 is not the one in|missing).*labgym data$"):
                read(folder)


def rewritten(folder: Path, name: str, change) -> Path:
    """Change the table of a file and record its new hash, as somebody does who means harm."""
    table = change(pq.read_table(folder / name))
    pq.write_table(table, folder / name)
    manifest = read_json(folder / "manifest.json")
    for entry in manifest["shards"]:
        if name in entry["files"]:
            entry["files"][name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
    write_json(folder / "manifest.json", manifest)
    return folder


def replaced(column: str, values):
    def change(table: pa.Table) -> pa.Table:
        index = table.schema.get_field_index(column)
        field = table.schema.field(index)
        array = values if isinstance(values, pa.Array) else pa.array([values] * len(table), field.type)
        return table.set_column(index, column, array)

    return change


HUGE_PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + (60_000).to_bytes(4, "big") * 2 + b"\x10\0\0\0\0" + b"\0" * 40


@pytest.mark.parametrize(
    ("name", "change", "problem"),
    [
        ("samples/00000.parquet", lambda table: table.slice(1), "has 11 samples, the manifest says 12"),
        ("samples/00000.parquet", lambda table: table.drop_columns(["action"]), "action: the column is missing"),
        ("samples/00000.parquet", replaced("path_length", pa.array(["x"] * 12)), "of type string, expected float"),
        ("samples/00000.parquet", replaced("path_length", None), "has a null"),
        ("samples/00000.parquet", replaced("path_length", math.nan), "not finite"),
        ("samples/00000.parquet", replaced("observation.state", [0.0, None, 0.0]), "has a null"),
        ("samples/00000.parquet", replaced("observation.images.depth", {"bytes": None, "path": None}), "has a null"),
        ("samples/00000.parquet", replaced("observation.images.depth", {"bytes": HUGE_PNG, "path": None}), "128 x 72"),
        ("samples/00000.parquet", replaced("map_index", 2), "names a map that it does not have"),
        ("samples/00000.parquet", replaced("map_index", -1), "names a map that it does not have"),
        ("maps/00000.parquet", replaced("rows", 0), "cells for 0 x"),
        ("maps/00000.parquet", replaced("columns", 2**40), "cells for"),
        ("maps/00000.parquet", replaced("resolution", 0.0), "cells for"),
        ("maps/00000.parquet", replaced("cost", [math.inf]), "cells for"),
    ],
)
def test_a_file_of_wrong_content_with_a_right_hash_is_refused(
    dataset: Path, tmp_path: Path, name: str, change, problem: str
) -> None:
    with pytest.raises(LabgymError, match=problem) as error:
        load_dataset(rewritten(copied(dataset, tmp_path / "data"), name, change))
    assert "\n" not in str(error.value)


def test_paths_lead_from_the_robot_to_the_goal(data: Dataset) -> None:
    assert np.abs(data.path[:, 0]).max() < 1e-6
    np.testing.assert_allclose(data.path[:, -1], data.goal, atol=1e-5)
    chords = np.linalg.norm(np.diff(data.path, axis=1), axis=2).sum(axis=1)
    assert (chords <= data.length + 1e-4).all()
    assert (chords >= 0.98 * data.length).all()


def test_the_robot_and_its_expert_keep_clear_of_everything(data: Dataset, dataset: Path, layouts: list[Layout]) -> None:
    clearances = np.concatenate(
        [pq.read_table(path)["path_clearance"].to_numpy() for path in sorted(dataset.glob("samples/*"))]
    )
    assert clearances.min() >= PLANNING_RADIUS - 1e-3  # arcs are given by chords
    for k in range(len(data)):
        layout = layouts[int(data.place[k])]
        boxes = [shapely.Polygon(box.corners()[:, :2]) for box in layout.obstacles(OBSTACLE_HEIGHT)]
        blocked = shapely.unary_union([*boxes, shapely.box(0, 0, layout.room.width, layout.room.depth).boundary])
        x, y, yaw = (float(value) for value in data.pose[k])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        there = data.path[k].astype(float) @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
        assert shapely.Point(x, y).distance(blocked) >= PLANNING_RADIUS - 1e-5
        # Its 64 points cut corners a little.
        assert shapely.LineString(there).distance(blocked) >= PLANNING_RADIUS - 0.02


def test_experts_are_no_shorter_than_the_shortest_path(data: Dataset, layouts: list[Layout]) -> None:
    for k in range(0, len(data), 5):
        x, y, yaw = (float(value) for value in data.pose[k])
        gx, gy = (float(value) for value in data.goal[k])
        goal = x + math.cos(yaw) * gx - math.sin(yaw) * gy, y + math.sin(yaw) * gx + math.cos(yaw) * gy
        shortest = shortest_path(layouts[int(data.place[k])], (x, y), goal, PLANNING_RADIUS - 1e-4)
        assert shortest is not None
        assert shortest.length - 1e-3 <= data.length[k] <= 1.3 * shortest.length + 0.3


def test_frames_are_what_the_camera_sees_there(data: Dataset, dataset: Path, layouts: list[Layout]) -> None:
    camera = Camera()
    row = pq.read_table(dataset / "samples/00001.parquet").to_pylist()[4]
    k = 12 + 4
    rays = RayScene(layouts[int(data.place[k])])
    x, y, yaw = (float(value) for value in data.pose[k])
    rgb, depth = camera.colour_and_depth(rays, (x, y, wrap_angle(yaw)))
    # The pose is stored in single precision: a ray beside an edge may hit what is behind it.
    assert (np.abs(data.depth[k] / 1000.0 - depth) <= 0.002).mean() > 0.995
    decoded = rgb_of(row["observation.images.rgb"]["bytes"]).astype(float)
    assert np.abs(decoded - rgb).mean() < 6.0


def test_depth_survives_to_the_millimeter_and_images_nearly() -> None:
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.0, 10.0, (72, 128)).astype(np.float32)
    assert np.abs(depth_of(depth_png(depth)) / 1000.0 - depth).max() <= 0.000501
    ramp = np.broadcast_to(np.arange(128, dtype=np.uint8)[None, :, None], (72, 128, 3))
    assert np.abs(rgb_of(jpeg(ramp)).astype(int) - ramp).max() <= 3


def test_costs_are_depths_inside_the_blocked_cells() -> None:
    blocked = np.zeros((60, 60), dtype=bool)
    blocked[:, 40:] = True
    cost = cost_map(blocked)
    assert cost[:, :30].max() < 1e-4
    # Far from the ends of the ramp a blur leaves it as it is: k cells in, the cost is log(1 + k).
    np.testing.assert_allclose(cost[30, 49], math.log1p(10.0), rtol=1e-3)
    assert (np.diff(cost[30, 33:58]) > 0.0).all()


def test_maps_agree_with_a_distance_transform_of_the_room(layouts: list[Layout]) -> None:
    maps, grid = privileged_maps(layouts[0]), occupancy(layouts[0])
    walled = np.pad(~grid.occupied, 20)
    np.testing.assert_allclose(maps.distance, np.maximum(distance_transform_edt(walled) - 0.5, 0.0) * 0.05, atol=1e-5)
    roomy = maps.distance > CLEARANCE_M + 0.5
    assert roomy.any()
    assert maps.cost[roomy].max() < 1e-4
    assert maps.cost[maps.distance == 0.0].min() > 0.5
    assert maps.origin == pytest.approx((-1.2, -1.2))


def in_room(pose: tuple[float, float, float], point: tuple[float, float]) -> tuple[float, float]:
    (x, y, yaw), (px, py) = pose, point
    return x + math.cos(yaw) * px - math.sin(yaw) * py, y + math.sin(yaw) * px + math.cos(yaw) * py


def test_the_frames_of_a_drive_follow_each_other_as_a_robot_can_drive_and_share_a_goal(layouts: list[Layout]) -> None:
    drawn = Situations(layouts[0]).drive(np.random.default_rng(2), 60)
    assert len(drawn) == 60
    assert [each.frame == 0 or each.frame == before.frame + 1 for before, each in pairwise(drawn)] == [True] * 59
    assert sum(each.frame == 0 for each in drawn) > 3
    for before, each in pairwise(drawn):
        if each.frame == 0:
            continue
        assert math.dist(before.pose[:2], each.pose[:2]) <= STRIDES_M[1] + 1e-9
        assert abs(wrap_angle(each.pose[2] - before.pose[2])) <= LARGEST_TURN_RAD + 1e-9
        assert in_room(each.pose, each.goal) == pytest.approx(in_room(before.pose, before.goal), abs=1e-9)
        assert each.kind == before.kind


def test_drives_get_nearer_to_their_goal_but_leave_the_expert_s_way(layouts: list[Layout]) -> None:
    drawn = Situations(layouts[0]).drive(np.random.default_rng(4), 80)
    steps = [(before, each) for before, each in pairwise(drawn) if each.frame]
    assert np.mean([each.length - before.length for before, each in steps]) < -0.1
    # Where the expert went straight on from the frame before, and where the drive went instead.
    aside = [
        shapely.LineString(before.path).distance(shapely.Point(_relative(before.pose, each.pose[:2])))
        for before, each in steps
    ]
    assert max(aside) > 0.05
    assert np.ptp([each.pose[2] for each in drawn]) > 1.0
    assert {each.kind for each in drawn} >= {"route"}


def _relative(pose: tuple[float, float, float], point: tuple[float, float]) -> tuple[float, float]:
    dx, dy = point[0] - pose[0], point[1] - pose[1]
    return math.cos(pose[2]) * dx + math.sin(pose[2]) * dy, math.cos(pose[2]) * dy - math.sin(pose[2]) * dx


def test_resampling_spaces_points_evenly_and_keeps_the_ends() -> None:
    points = resampled(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]]), 5)
    np.testing.assert_allclose(points, [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1]], atol=1e-12)


def test_columns_are_plain_arrow_types_that_other_readers_know(dataset: Path) -> None:
    table = pq.read_table(dataset / "samples/00000.parquet")
    columns = DatasetManifest.load(dataset / "manifest.json").columns
    assert {field.name: str(field.type) for field in table.schema} == columns
    assert table["index"].to_pylist() == list(range(12))
    frames, episodes = table["frame_index"].to_pylist(), table["episode_index"].to_pylist()
    assert [index - frame for index, frame in enumerate(frames)] == episodes
    assert max(frames) == 2
    assert table["timestamp"].to_pylist() == [0.5 * frame for frame in frames]


def test_pictures_come_in_the_order_of_the_samples(dataset: Path, data: Dataset) -> None:
    assert np.diff(data.drive).min() >= 0
    table = pq.read_table(dataset / "samples/00001.parquet").to_pylist()
    decoded = list(pictures(dataset, 17))
    assert len(decoded) == 17
    np.testing.assert_array_equal(decoded[14], rgb_of(table[2]["observation.images.rgb"]["bytes"]))


def test_the_commands_make_a_dataset_and_train_on_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "data"
    assert main(["data", "--out", str(folder), "--samples", "4", "--seed", "3"]) == 0
    assert len(load_dataset(folder)) == 4
    assert main(["train", "iplanner", "--data", str(folder), "--out", str(tmp_path / "run"), "--epochs", "1"]) == 0
    assert (tmp_path / "run" / "weights.safetensors").exists()
    assert main(["data", "--out", str(folder), "--samples", "0"]) == 2
    assert "samples is 0, expected a whole number from 1" in capsys.readouterr().err
