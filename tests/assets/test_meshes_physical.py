"""The physical phase: heading, origin, bounding box, closedness, convex bodies."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from labgym.assets.meshes import MeshError, MeshFile, MeshPart, normalize, physical, read_mesh
from labgym.assets.meshes.polygons import triangulate
from labgym.errors import UnknownNameError


def mesh_file(*bodies: trimesh.Trimesh, up="Z") -> MeshFile:
    parts = tuple(MeshPart(f"p{k}", np.array(b.vertices), np.array(b.faces)) for k, b in enumerate(bodies))
    return MeshFile(parts, "thing", "thing.stl", "m", "option", up, "option")


def wedge() -> trimesh.Trimesh:
    """Return a box 1 x 2 x 3 whose point (9, 0, 0) tells where its +x side went."""
    return trimesh.convex.convex_hull([*trimesh.creation.box(extents=(1, 2, 3)).vertices, (1.5, 0, 0)])


@pytest.mark.parametrize(
    "front, tip", [("+x", (0, 1)), ("-x", (0, -1)), ("+y", (1, 0)), ("-y", (-1, 0)), (None, (1, 0))]
)
def test_the_front_is_turned_to_y_and_the_origin_is_at_the_bottom_centre(front, tip):
    moved = wedge()
    moved.apply_translation((5, 6, 7))
    mesh = normalize(mesh_file(moved), front, hulls_only=True)
    vertices = mesh.parts[0].vertices
    extents = (2.0, 2.0, 3.0)
    assert (mesh.size.width, mesh.size.depth, mesh.size.height) == pytest.approx(extents)
    np.testing.assert_allclose([vertices.min(axis=0), vertices.max(axis=0)], [[-1, -1, 0], [1, 1, 3]], atol=1e-12)
    farthest = vertices[np.argmax(vertices[:, :2] @ np.array(tip))]
    np.testing.assert_allclose(farthest, [*tip, 1.5], atol=1e-12)
    assert trimesh.Trimesh(vertices, mesh.parts[0].faces).volume == pytest.approx(moved.volume)


def test_the_front_of_gltf_is_its_z_axis(tmp_path):
    # The tip points along z of a file with y up.
    body = wedge()
    body.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (0, 1, 0)))
    body.export(tmp_path / "a.glb")
    vertices = normalize(read_mesh(tmp_path / "a.glb"), hulls_only=True).parts[0].vertices
    tips = vertices[vertices[:, 1] > vertices[:, 1].max() - 1e-6]
    np.testing.assert_allclose(np.ptp(tips, axis=0), 0, atol=1e-6)


def test_a_front_that_looks_up_or_has_no_name_is_refused():
    with pytest.raises(MeshError, match="vertical"):
        normalize(mesh_file(wedge()), "+z")
    with pytest.raises(MeshError, match="vertical"):
        normalize(mesh_file(wedge(), up="Y"), "-y")
    with pytest.raises(UnknownNameError, match="forwards"):
        normalize(mesh_file(wedge()), "forwards")


def test_flat_and_gigantic_things_are_refused_with_the_unit_named():
    square = trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    with pytest.raises(MeshError, match=r"1 x 1 x 0 m.*unit"):
        normalize(mesh_file(square))
    with pytest.raises(MeshError, match=r"2000 x .* m, read in m \(option\).*unit"):
        normalize(mesh_file(trimesh.creation.box(extents=(2000, 100, 100))))


def test_closed_meshes_are_watertight_with_the_volume_of_the_formula():
    mesh = normalize(mesh_file(trimesh.creation.box(extents=(1, 2, 3)), trimesh.creation.icosphere(4)), hulls_only=True)
    assert mesh.watertight
    assert mesh.volume == pytest.approx(6.0 + 4.0 / 3.0 * np.pi, rel=0.01)


@pytest.mark.parametrize("fault", ["hole", "flipped", "third face on an edge"])
def test_open_and_non_manifold_meshes_are_accepted_and_said_not_to_be_watertight(fault):
    box = trimesh.creation.box()
    vertices, faces = np.array(box.vertices), np.array(box.faces)
    if fault == "hole":
        faces = faces[1:]
    elif fault == "flipped":
        faces[0] = faces[0, ::-1]
    else:
        vertices = np.vstack([vertices, (3, 3, 3)])
        faces = np.vstack([faces, (*faces[0, :2], 8)])
    mesh = normalize(mesh_file(trimesh.Trimesh(vertices, faces, process=False)), hulls_only=True)
    assert not mesh.watertight
    assert mesh.volume is None
    assert mesh.convex


def check_convex(bodies):
    for vertices, faces in bodies:
        body = trimesh.Trimesh(vertices, faces)
        assert body.is_watertight
        assert body.is_convex
        assert body.volume > 0.0


@pytest.fixture
def bowl() -> trimesh.Trimesh:
    """A thick half shell: far from convex."""
    return trimesh.creation.revolve([(0, 0), (1, 0), (1, 1), (0.9, 1), (0.9, 0.1), (0, 0.1)], sections=24)


def test_coacd_leaves_the_hollow_of_a_bowl_free_and_is_repeatable(bowl):
    pytest.importorskip("coacd")
    first, second = (normalize(mesh_file(bowl)) for _ in range(2))
    assert first.decomposed_by == "coacd"
    check_convex(first.convex)
    assert sum(trimesh.Trimesh(*body).volume for body in first.convex) < 0.5 * bowl.convex_hull.volume
    assert len(first.convex) == len(second.convex)
    for one, other in zip(first.convex, second.convex, strict=True):
        np.testing.assert_array_equal(one[0], other[0])


def test_without_coacd_each_part_has_its_hull(bowl, monkeypatch):
    monkeypatch.setattr(physical.importlib.util, "find_spec", lambda name: None)
    mesh = normalize(mesh_file(bowl, trimesh.creation.box()))
    assert (mesh.decomposed_by, len(mesh.convex)) == ("convex hull", 2)
    check_convex(mesh.convex)
    assert trimesh.Trimesh(*mesh.convex[0]).volume == pytest.approx(bowl.convex_hull.volume)


def test_meshes_too_fine_for_coacd_have_hulls_and_it_is_said(bowl, monkeypatch):
    pytest.importorskip("coacd")
    monkeypatch.setattr(physical, "MAX_FACES", len(bowl.faces) - 1)
    mesh = normalize(mesh_file(bowl, trimesh.creation.box()))
    assert (mesh.decomposed_by, len(mesh.convex)) == ("convex hull", 2)


def test_meshes_of_more_concave_parts_than_allowed_have_hulls_and_it_is_said(bowl, monkeypatch):
    """Convex parts do not count; coacd itself, which takes two seconds a part, does not run."""
    monkeypatch.setattr(physical.importlib.util, "find_spec", lambda name: object())
    decomposed = []
    whole = lambda parts, budget: decomposed.append(len(parts)) or ([[part.vertices] for part in parts], "")  # noqa: E731
    monkeypatch.setattr(physical, "_by_coacd", whole)
    for count, method in ((16, "coacd"), (17, "convex hull")):
        parts = mesh_file(*[bowl] * count, *[trimesh.creation.box()] * 5).parts
        result = physical.decompose(parts)
        assert (result.method, len(result.bodies)) == (method, count + 5)
        assert ("17 concave parts are too many" in result.note) == (count == 17)
    assert decomposed == [16]


def test_flat_parts_become_thin_plates(bowl):
    square = trimesh.Trimesh([(0, 0, 2), (1, 0, 2), (0, 1, 2)], [(0, 1, 2)])
    slanted = trimesh.Trimesh([(0, 0, 0), (1, 0, 1), (0, 1, 0)], [(0, 1, 2)])
    check_convex(normalize(mesh_file(square, slanted)).convex)


def test_hundreds_of_parts_are_decomposed_as_one(monkeypatch):
    monkeypatch.setattr(physical.importlib.util, "find_spec", lambda name: None)
    boxes = [trimesh.creation.box(transform=trimesh.transformations.translation_matrix((k, 0, 0))) for k in range(9)]
    assert len(normalize(mesh_file(*boxes)).convex) == 9
    monkeypatch.setattr(physical, "MAX_BODIES", 8)
    assert len(normalize(mesh_file(*boxes)).convex) == 1


@pytest.mark.parametrize("count", [4, 5, 7, 12, 40])
@pytest.mark.parametrize("plane", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2)])
def test_star_shaped_polygons_keep_area_and_side_in_any_plane(count, plane):
    rng = np.random.default_rng(count)
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    radii = rng.uniform(0.2, 1.0, count)
    flat = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.full(count, 0.3)], axis=1)
    x, y = flat[:, 0], flat[:, 1]
    shoelace = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    points = flat[:, plane]
    faces, owner = triangulate(points, np.array([count]), np.arange(count))
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
    assert len(faces) == count - 2
    assert (owner == 0).all()
    assert np.linalg.norm(normals, axis=1).sum() == pytest.approx(shoelace)
    assert np.linalg.norm(normals.sum(axis=0)) == pytest.approx(shoelace)


@pytest.mark.parametrize("suffix", ["glb", "stl", "obj"])
def test_files_with_flipped_bytes_are_read_or_refused_but_never_crash(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    trimesh.creation.icosphere(subdivisions=1).export(path)
    sound = path.read_bytes()
    rng = np.random.default_rng(7)
    outcomes = set()
    for _ in range(300):
        content = np.frombuffer(sound, dtype=np.uint8).copy()
        content[rng.integers(0, min(len(content), 2000), size=3)] = rng.integers(0, 256, size=3)
        path.write_bytes(content.tobytes())
        try:
            outcomes.add(len(read_mesh(path).parts) > 0)
        except MeshError as error:
            outcomes.add(error.file == str(path))
    assert outcomes == {True}
