"""What every shape promises: it fills its box and no more, it is solid, and nothing in it flickers."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import trimesh
from every_case import for_each

from labgym.assets import Asset, Catalog
from labgym.assets.model import Shape, Size
from labgym.assets.shapes import MATERIALS, SHAPES, Part, build, tessellate
from labgym.assets.shapes.materials import coating, substance
from labgym.assets.shapes.parts import between, block, rod, rounded, tube
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts.placement import resized

ASSETS = Catalog.load().assets
REACH = 0.005
"""How near the parts come to each face of the box, metres."""


def box(asset: Asset) -> np.ndarray:
    w, d, h = asset.size.width, asset.size.depth, asset.size.height
    return np.array([[-w / 2.0, -d / 2.0, 0.0], [w / 2.0, d / 2.0, h]])


def variants() -> list[Asset]:
    """One asset of each shape with each set of parameters and size."""
    seen: dict[str, Asset] = {}
    for asset in ASSETS:
        seen.setdefault(f"{asset.shape.name} {sorted(asset.shape.parameters.items())} {asset.size}", asset)
    return list(seen.values())


def by_name(asset: Asset) -> str:
    return asset.name


@for_each("asset", ASSETS)
def test_parts_stay_inside_the_bounding_box_and_reach_its_six_faces(asset: Asset) -> None:
    bounds = np.array([part.bounds() for part in build(asset)])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    limits = box(asset)
    for fitting in asset.fittings:
        limits[1, 2] = max(limits[1, 2], fitting.z1)
    assert (low >= limits[0] - 1e-6).all()
    assert (high <= limits[1] + 1e-6).all()
    assert np.abs(low - limits[0]).max() < REACH
    assert np.abs(high - limits[1]).max() < REACH


def test_the_tap_of_a_sink_bench_stands_beside_its_surface() -> None:
    asset = Catalog.load().get("SinkBench")
    surface = asset.surfaces[0]
    above = [part.bounds() for part in build(asset) if part.bounds()[1][2] > asset.size.height + 1e-6]
    assert above
    assert min(bounds[0][0] for bounds in above) > surface.x + surface.width / 2.0


@pytest.mark.parametrize("depth", [0.75, 0.85])
def test_the_solids_of_a_sink_bench_cover_its_tap_closely(depth: float) -> None:
    asset = resized(Catalog.load().get("SinkBench"), Size(width=1.2, depth=depth, height=0.92))
    top = asset.size.height
    tap = np.array([part.bounds() for part in build(asset) if part.bounds()[1][2] > top + 1e-6])
    low, high = np.maximum(tap[:, 0].min(axis=0), (-9.0, -9.0, top)), tap[:, 1].max(axis=0)
    solid = asset.solids()[-1]
    near = (solid.x - solid.width / 2.0, solid.y - solid.depth / 2.0, solid.z0)
    far = (solid.x + solid.width / 2.0, solid.y + solid.depth / 2.0, solid.z1)
    assert (low >= np.array(near) - 1e-6).all()
    assert (high <= np.array(far) + 1e-6).all()
    np.testing.assert_allclose([near, far], [low, high], atol=0.003)


@for_each("asset", [asset for asset in ASSETS if asset.cavity])
def test_hollow_assets_leave_their_hollow_to_what_stands_in_it(asset: Asset) -> None:
    cavity = asset.cavity
    assert cavity is not None
    shelves = [surface.z for surface in asset.surfaces if surface.z > cavity.z0]
    low = np.array([cavity.x - cavity.width / 2.0, cavity.y - cavity.depth / 2.0, cavity.z0])
    high = np.array([cavity.x + cavity.width / 2.0, cavity.y + cavity.depth / 2.0, cavity.z1])
    for part in build(asset):
        bounds = part.bounds()
        overlap = np.minimum(bounds[1], high) - np.maximum(bounds[0], low)
        inside = overlap.min()
        shelf = any(abs(bounds[1][2] - z) < 1e-6 for z in shelves)
        # A lamp may hang a little below the top.
        assert inside < 0.013 or shelf, f"{part.primitive} of {part.material} stands {inside:.3f} m inside"


@pytest.mark.cases(80)
@pytest.mark.parametrize("asset", variants(), ids=by_name)
def test_every_part_is_a_watertight_solid_with_a_known_material(asset: Asset) -> None:
    for part in build(asset):
        assert part.material in MATERIALS
        vertices, faces = tessellate(part)
        mesh = trimesh.Trimesh(vertices, faces)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume > 0.0


@for_each("asset", variants())
def test_tessellated_parts_lie_inside_their_exact_bounds_and_nearly_fill_them(asset: Asset) -> None:
    for part in build(asset):
        exact, found = part.bounds(), tessellate(part)[0]
        extent = float(np.max(exact[1] - exact[0]))
        assert (found.min(axis=0) >= exact[0] - 1e-9).all()
        assert (found.max(axis=0) <= exact[1] + 1e-9).all()
        assert np.abs(found.min(axis=0) - exact[0]).max() < 0.08 * extent
        assert np.abs(found.max(axis=0) - exact[1]).max() < 0.08 * extent


def upright(part: Part) -> bool:
    return part.primitive in ("box", "prism") and np.allclose(np.abs(part.rotation).max(axis=0), 1.0)


@for_each("asset", variants())
def test_no_two_colours_share_a_visible_face(asset: Asset) -> None:
    """Coplanar faces of different materials would flicker; backs and undersides are not seen."""
    parts = [part for part in build(asset) if upright(part)]
    bounds = np.array([part.bounds() for part in parts]).reshape(-1, 2, 3)
    for (i, one), (j, other) in itertools.combinations(enumerate(parts), 2):
        if one.material == other.material:
            continue
        shared = np.minimum(bounds[i, 1], bounds[j, 1]) - np.maximum(bounds[i, 0], bounds[j, 0])
        for axis, end in ((0, 0), (0, 1), (1, 1), (2, 1)):
            others = [k for k in range(3) if k != axis]
            if abs(bounds[i, end, axis] - bounds[j, end, axis]) < 1e-4 and (shared[others] > 0.012).all():
                spot = (np.minimum(bounds[i, 1], bounds[j, 1]) + np.maximum(bounds[i, 0], bounds[j, 0])) / 2.0
                spot[axis] = bounds[i, end, axis] + (1e-3 if end else -1e-3)
                covered = ((spot > bounds[:, 0]) & (spot < bounds[:, 1])).all(axis=1).any()
                assert covered, f"{one.material} and {other.material} share a face across axis {axis}"


def test_the_whole_catalogue_stays_light_enough_to_draw() -> None:
    counts = {asset.name: sum(len(tessellate(part)[1]) for part in build(asset)) for asset in ASSETS}
    assert max(counts.values()) < 6000
    assert np.mean([counts[asset.name] for asset in ASSETS if asset.kind == "instrument"]) < 1500


def test_every_shape_is_used_by_the_catalogue() -> None:
    # Imported assets have a mesh; glass screens are of the condition "glass", not of the catalog.
    assert {asset.shape.name for asset in ASSETS} == set(SHAPES) - {"mesh", "glass_screen"}


def with_shape(name: str, **parameters: float | str | bool) -> Asset:
    return Catalog.load().get("Beaker").model_copy(update={"shape": Shape(name=name, parameters=parameters)})


def test_an_unknown_shape_names_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match=r"'beeker' not found; nearest: beaker"):
        build(with_shape("beeker"))


@pytest.mark.parametrize(
    ("shape", "parameters"),
    [("beaker", {"lid": 3.0}), ("round_flask", {"necks": "two"}), ("dish", {"material": True})],
)
def test_a_parameter_of_the_wrong_type_is_refused(shape: str, parameters: dict[str, float | str | bool]) -> None:
    with pytest.raises(OptionError, match=r"shape parameter .* expected"):
        build(with_shape(shape, **parameters))


def test_unknown_colours_and_substances_list_what_exists() -> None:
    with pytest.raises(UnknownNameError, match="yellow"):
        coating("yelow")
    with pytest.raises(UnknownNameError, match="porcelain"):
        substance("china")


def test_a_shape_that_needs_a_hollow_says_so() -> None:
    with pytest.raises(OptionError, match="needs a cavity"):
        build(with_shape("cabinet"))


def test_building_twice_gives_equal_parts() -> None:
    assert all(build(asset) == build(asset) for asset in variants())


def test_blocks_take_spans_in_either_order() -> None:
    assert block("oak", (1.0, 0.0), (0.0, 2.0), (3.0, 0.0)) == block("oak", (0.0, 1.0), (2.0, 0.0), (0.0, 3.0))


def test_rods_end_at_their_points_and_lie_along_their_line() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        start, end = (tuple(rng.uniform(-1.0, 1.0, 3).tolist()) for _ in range(2))
        part = rod("oak", 0.02, start, end)
        axis = part.rotation[:, 2]
        assert np.allclose(np.array(part.position) - axis * part.size[2] / 2.0, start, atol=1e-9)
        assert np.allclose(np.array(part.position) + axis * part.size[2] / 2.0, end, atol=1e-9)


def test_turning_one_direction_to_another_works_for_opposites_too() -> None:
    for target in ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.0, 0.8)):
        part = Part("box", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), between((0.0, 0.0, 1.0), target), "oak")
        assert np.allclose(part.rotation[:, 2], target)
        assert np.allclose(part.rotation @ part.rotation.T, np.eye(3))


def test_tubes_join_without_gaps() -> None:
    points = [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 1.0)]
    first, second = tube("chrome", 0.1, points)
    assert first.bounds()[1][2] == pytest.approx(1.05)
    assert second.bounds()[0][0] == pytest.approx(-0.05)


def test_rounded_blocks_lose_only_their_corners() -> None:
    part = rounded("oak", (0.0, 2.0), (0.0, 1.0), (0.0, 1.0), 0.2)
    vertices, faces = tessellate(part)
    lost = 4.0 * (0.2**2 - np.pi * 0.2**2 / 4.0)
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(2.0 - lost, abs=0.01)
