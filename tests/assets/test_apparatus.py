"""Assembled apparatus: clamps touch what they hold, joints meet, flasks rest in their baths, and nothing overlaps.

Everything is measured on the visible meshes, at the poses that the slots of a stand give to its pieces.
"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import trimesh

from labgym.artefacts import artefacts
from labgym.assets import Asset, Catalog
from labgym.assets.model import APPARATUS_STAND
from labgym.assets.shapes import build, tessellate
from labgym.protocols import protocols

CATALOG = Catalog.load()
STANDS = [asset for asset in CATALOG if asset.subtype == APPARATUS_STAND]
SETUPS = {
    setup["stand"]: setup["pieces"]
    for setup in json.loads((artefacts("assets") / "layouts" / "setups.json").read_text())["setups"]
}
stands = pytest.mark.parametrize("stand", STANDS, ids=lambda asset: asset.name)


def parts(asset: Asset, *materials: str) -> list[tuple[str, np.ndarray, np.ndarray]]:
    return [(part.material, *tessellate(part)) for part in build(asset) if not materials or part.material in materials]


def piece(stand: Asset, name: str) -> trimesh.Trimesh:
    """Return the mesh of a piece in the frame of its stand."""
    slot = next(k for k, names in enumerate(SETUPS[stand.name]) if name in names)
    surface, asset = stand.surfaces[slot], CATALOG.get(name)
    meshes = [trimesh.Trimesh(v, f, process=False) for _, v, f in parts(asset)]
    mesh = trimesh.util.concatenate(meshes)
    mesh.apply_translation((surface.x, surface.y, surface.z))
    return mesh


def gap(mesh: trimesh.Trimesh, points: np.ndarray) -> float:
    """Return the least distance between points and faces, meters."""
    low, high = points.min(axis=0) - 0.03, points.max(axis=0) + 0.03
    near = (mesh.triangles.max(axis=1) > low).all(axis=1) & (mesh.triangles.min(axis=1) < high).all(axis=1)
    triangles = mesh.triangles[near]
    if not len(triangles):
        return math.inf
    pairs = np.repeat(triangles, len(points), axis=0), np.tile(points, (len(triangles), 1))
    return float(np.linalg.norm(trimesh.triangles.closest_point(*pairs) - pairs[1], axis=1).min())


def numbers(stand: Asset, name: str) -> list[tuple[float, ...]]:
    text = str(stand.shape.parameters.get(name, ""))
    return [tuple(float(word) for word in row.split()) for row in text.split(";") if row.strip()]


def has(stand: Asset, name: str) -> bool:
    return any(name in names for names in SETUPS[stand.name])


@stands
def test_every_stand_has_a_setup_with_a_piece_for_each_slot(stand: Asset) -> None:
    assert len(SETUPS[stand.name]) == len(stand.surfaces)
    for names, surface in zip(SETUPS[stand.name], stand.surfaces, strict=True):
        for name in names:
            size = CATALOG.get(name).size
            assert size.width <= surface.width + 1e-9
            assert size.depth <= surface.depth + 1e-9


@stands
def test_pieces_keep_to_the_footprint_of_their_stand(stand: Asset) -> None:
    for surface in stand.surfaces:
        assert abs(surface.x) + surface.width / 2.0 <= stand.size.width / 2.0 + 1e-9
        assert abs(surface.y) + surface.depth / 2.0 <= stand.size.depth / 2.0 + 1e-9


@stands
def test_each_clamp_touches_a_round_piece_from_both_sides(stand: Asset) -> None:
    for x, y, z, radius, _ in numbers(stand, "clamps"):
        touched = []
        for names in SETUPS[stand.name]:
            mesh = piece(stand, names[0])
            section = mesh.section((0.0, 0.0, 1.0), (0.0, 0.0, z))
            if section is None:
                continue
            around = np.asarray(section.vertices)[:, :2] - (x, y)
            reach = np.hypot(*around[np.hypot(*around.T) < 1.2 * radius].T)
            if len(reach) and abs(reach.max() - radius) < 0.001:
                touched.append(names[0])
        assert len(touched) == 1, (stand.name, z, touched)


@stands
def test_solids_of_a_stand_match_what_is_visible(stand: Asset) -> None:
    """Rods and arms lie in solids, and every solid holds a part of the stand."""
    metal = [vertices for _, vertices, _ in parts(stand, "stainless", "chrome")]
    solids = stand.solids()
    for vertices in metal:
        inside = np.zeros(len(vertices), dtype=bool)
        for solid in solids:
            local = np.abs(vertices[:, :2] - (solid.x, solid.y))
            within = (local <= (solid.width / 2.0 + 0.002, solid.depth / 2.0 + 0.002)).all(axis=1)
            inside |= within & (vertices[:, 2] > solid.z0 - 0.002) & (vertices[:, 2] < solid.z1 + 0.002)
        assert inside.all()
    everything = np.concatenate([vertices for _, vertices, _ in parts(stand)])
    for solid in solids[1:]:
        local = np.abs(everything[:, :2] - (solid.x, solid.y))
        within = (local <= (solid.width / 2.0 + 1e-6, solid.depth / 2.0 + 1e-6)).all(axis=1)
        assert (within & (everything[:, 2] >= solid.z0 - 1e-6) & (everything[:, 2] <= solid.z1 + 1e-6)).any()


@pytest.mark.cases(4)
@stands
def test_nothing_stands_on_its_tip(stand: Asset) -> None:
    """Each piece that has no flat bottom is above the base, and touches another piece, a clamp, a ring or a cone."""
    flat = ("hotplate", "mantle", "bath", "erlenmeyer", "beaker", "filter_flask")
    for slot, names in enumerate(SETUPS[stand.name]):
        for name in names:
            if CATALOG.get(name).shape.name in flat:
                continue
            bottom = stand.surfaces[slot].z
            assert bottom > stand.size.height + 0.003 or stand.shape.parameters.keys() & {"corks", "wells"}
            own = piece(stand, name)
            holders = [trimesh.Trimesh(v, f, process=False) for _, v, f in parts(stand)]
            holders += [piece(stand, other[0]) for k, other in enumerate(SETUPS[stand.name]) if k != slot]
            gaps = [gap(own, np.concatenate([holder.vertices, holder.triangles_center])) for holder in holders]
            assert min(gaps) < 0.001, (stand.name, name)


@pytest.mark.parametrize("lower", ["RoundBottomFlask", "ThreeNeckFlask"])
def test_a_condenser_sits_in_the_neck_of_its_flask(lower: str) -> None:
    for stand in STANDS:
        if not (has(stand, lower) and has(stand, "RefluxCondenser")) or has(stand, "DeanStarkTrap"):
            continue
        flask, condenser = piece(stand, lower), piece(stand, "RefluxCondenser")
        rim = flask.vertices[flask.vertices[:, 2] > flask.bounds[1, 2] - 1e-6]
        cone = condenser.vertices[condenser.vertices[:, 2] < condenser.bounds[0, 2] + 1e-6]
        assert np.allclose(rim[:, :2].mean(axis=0), cone[:, :2].mean(axis=0), atol=0.001)
        assert condenser.bounds[0, 2] == pytest.approx(flask.bounds[1, 2] - 0.020, abs=0.001)
        neck = 0.0115 if lower == "RoundBottomFlask" else 0.013
        assert np.hypot(*(cone[:, :2] - cone[:, :2].mean(axis=0)).T).max() < neck


def test_a_dropping_funnel_meets_its_bent_adapter_and_the_adapter_the_side_neck() -> None:
    stand = CATALOG.get("AdditionStandOilBath")
    ((x0, z0, x1, z1, y),) = numbers(stand, "bends")
    funnel, flask = piece(stand, "DroppingFunnel"), piece(stand, "ThreeNeckFlask")
    cone = funnel.vertices[funnel.vertices[:, 2] < funnel.bounds[0, 2] + 1e-6]
    assert np.allclose(cone[:, :2].mean(axis=0), (x1, y), atol=0.001)
    assert funnel.bounds[0, 2] == pytest.approx(z1 - 0.020, abs=0.001)
    side = flask.vertices[flask.vertices[:, 0] > flask.bounds[1, 0] - 0.02]
    assert np.hypot(side[:, 0] - x0, side[:, 2] - z0).min() < 0.012


def test_a_sphere_rests_on_the_inner_edge_of_its_cork_ring() -> None:
    for stand in STANDS:
        for _, _, top, inner, _ in numbers(stand, "corks"):
            ((name,),) = SETUPS[stand.name]
            radius = CATALOG.get(name).size.depth / 2.0
            center = stand.surfaces[0].z + radius
            assert math.hypot(inner, center - top) == pytest.approx(radius, abs=1e-4)


def test_a_separatory_funnel_rests_in_its_ring_above_the_receiver() -> None:
    stand = CATALOG.get("SeparationStand")
    ((x, y, z, radius, _),) = numbers(stand, "rings")
    funnel = piece(stand, "SeparatoryFunnel")
    section = funnel.section((0.0, 0.0, 1.0), (0.0, 0.0, z))
    assert section is not None
    reach = np.hypot(*(np.asarray(section.vertices)[:, :2] - (x, y)).T)
    assert reach.max() == pytest.approx(radius, abs=0.001)
    for name in SETUPS["SeparationStand"][0]:
        vessel = piece(stand, name)
        assert 0.002 < funnel.bounds[0, 2] - vessel.bounds[1, 2] < 0.08
        mouth = vessel.vertices[vessel.vertices[:, 2] > vessel.bounds[1, 2] - 0.01, :2]
        assert (np.abs(mouth - (x, y)).max(axis=0) < 0.06).all()


@pytest.mark.parametrize("name", [stand.name for stand in STANDS if "HeatingMantle" in str(SETUPS[stand.name])])
def test_a_flask_touches_the_nest_of_its_mantle_and_does_not_enter_it(name: str) -> None:
    stand = CATALOG.get(name)
    flask = next(names[0] for names in SETUPS[name] if "Flask" in names[0])
    radius = CATALOG.get(flask).size.depth / 2.0
    slot = next(k for k, names in enumerate(SETUPS[name]) if names[0] == flask)
    seat, mantle = stand.surfaces[slot], stand.surfaces[0]
    center = np.array([seat.x, seat.y, seat.z + radius])
    nest = [v for material, v, _ in parts(CATALOG.get("HeatingMantle"), "foam")]
    points = np.concatenate(nest) + np.array([mantle.x, mantle.y, mantle.z])
    assert np.linalg.norm(points - center, axis=1).min() == pytest.approx(radius, abs=0.0015)


@stands
def test_bottoms_of_flasks_are_above_the_floor_of_their_bath(stand: Asset) -> None:
    bath = next((k for k, names in enumerate(SETUPS[stand.name]) if names[0] in ("OilBath", "IceBath")), None)
    if bath is None:
        return
    low, size = stand.surfaces[bath].z, CATALOG.get(SETUPS[stand.name][bath][0]).size
    flask = stand.surfaces[bath + 1]
    assert low + 0.003 < flask.z < low + 0.6 * size.height
    assert max(abs(flask.x - stand.surfaces[bath].x), abs(flask.y - stand.surfaces[bath].y)) < 0.001


def test_every_piece_of_a_setup_is_used_by_a_protocol_or_an_accessory() -> None:
    used = {name for protocol in protocols().values() for name in protocol.instruments}
    for stand, pieces in SETUPS.items():
        assert any(name in used for names in pieces for name in names), stand
