"""Collisions by MuJoCo: pairs of placements whose solids interpenetrate in the compiled scene."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.layouts import Layout
from labgym.scenes.mjcf import COLLISION_GROUP, to_mjcf


@dataclass(frozen=True, order=True)
class Contact:
    """Two placements whose solids overlap.

    Attributes:
        a, b: ids in the layout's order.
        depth: smallest translation that separates the pair of their solids that overlap most, meters.
    """

    a: str
    b: str
    depth: float


def contacts(layout: Layout, depth: float = 0.001) -> tuple[Contact, ...]:
    """Return the pairs of placements that interpenetrate by more than `depth` meters in the compiled scene.

    MuJoCo computes no contacts between static bodies. Therefore `mj_geomDistance`, which is negative for overlapping
    geoms, is evaluated for every pair of solids whose axis-aligned bounds overlap. A placement does not count as
    touching its support, nor do the pieces of one assembled apparatus as touching each other. The number of pairs is
    the metric CN_mj; it shares no code with `labgym.geometry`.
    """
    model = to_mjcf(layout, visible=False).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    order = {model.body(placement.id).id: index for index, placement in enumerate(layout.placements)}
    solids = [
        geom
        for geom in range(model.ngeom)
        if model.geom_group[geom] == COLLISION_GROUP and model.geom_bodyid[geom] in order
    ]
    deepest: dict[tuple[int, int], float] = {}
    points = np.zeros(6)
    for first, second in _candidates(model, data, solids):
        overlap = -mujoco.mj_geomDistance(model, data, first, second, 0.0, points)
        if overlap > depth:
            pair = order[model.geom_bodyid[first]], order[model.geom_bodyid[second]]
            key = (min(pair), max(pair))
            deepest[key] = max(overlap, deepest.get(key, 0.0))
    ids = [placement.id for placement in layout.placements]
    stands = [layout.apparatus(placement_id) for placement_id in ids]
    return tuple(
        Contact(ids[a], ids[b], overlap)
        for (a, b), overlap in sorted(deepest.items())
        if stands[a] is None or stands[a] != stands[b]
    )


def _candidates(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> NDArray[np.int64]:
    """Return the pairs of geoms of different bodies whose axis-aligned bounds overlap, shape (n, 2)."""
    rotation = data.geom_xmat[geoms].reshape(-1, 3, 3)
    reach = np.einsum("nij,nj->ni", np.abs(rotation), model.geom_aabb[geoms, 3:])
    middle = data.geom_xpos[geoms] + np.einsum("nij,nj->ni", rotation, model.geom_aabb[geoms, :3])
    low, high = middle - reach, middle + reach
    overlap = np.all((low[:, None] < high[None, :]) & (low[None, :] < high[:, None]), axis=-1)
    body = model.geom_bodyid[geoms]
    first, second = np.nonzero(np.triu(overlap & (body[:, None] != body[None, :]), k=1))
    index = np.array(geoms, dtype=np.int64)
    return np.stack([index[first], index[second]], axis=1)
