"""What is wrong with a compiled scene, by MuJoCo's distances and rays."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
import shapely

from labgym.eval.outside.checks import DEEP, DISC, LOOSE_FIT, ROBOT_TOP, OutsideFinding, unreached
from labgym.eval.outside.written_plan import WrittenItem, WrittenPlan


def simulator_findings(plan: WrittenPlan, model: mujoco.MjModel) -> list[OutsideFinding]:
    """Return what is wrong with the compiled scene, in which drawers and doors stand open as the layout says.

    Solid geoms interpenetrate, an object stands on nothing, or the robot does not reach a goal between the geoms.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geoms = list(_outlines_of_geoms(model, data))
    blocked = unreached(plan, "simulated goal", DISC, geoms, plan.goals(), {})
    deep = [finding for finding in _deep_contacts(model, data) if not plan.assembled(*finding.who)]
    return [*deep, *_hanging(plan, model, data), *blocked]


def _outlines_of_geoms(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[shapely.Polygon]:
    """The outlines on the floor of solid geoms in the robot's way, as hulls of the corners of their boxes."""
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for geom in np.flatnonzero((model.geom_group == 3) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)):
        corners = model.geom_aabb[geom, :3] + signs * model.geom_aabb[geom, 3:]
        world = data.geom_xpos[geom] + corners @ data.geom_xmat[geom].reshape(3, 3).T
        if world[:, 2].min() < ROBOT_TOP:
            yield shapely.MultiPoint(world[:, :2]).convex_hull


def _deep_contacts(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[OutsideFinding]:
    solid = np.flatnonzero((model.geom_group == 3) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    rotation = np.abs(data.geom_xmat[solid].reshape(-1, 3, 3))
    center = data.geom_xpos[solid] + np.einsum(
        "nij,nj->ni", data.geom_xmat[solid].reshape(-1, 3, 3), model.geom_aabb[solid, :3]
    )
    half = np.einsum("nij,nj->ni", rotation, model.geom_aabb[solid, 3:])
    low, high = center - half, center + half
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    first, second = shapely.STRtree(boxes).query(boxes, predicate="intersects")
    rise = np.minimum(high[first, 2], high[second, 2]) - np.maximum(low[first, 2], low[second, 2])
    bodies = model.geom_bodyid[solid]
    pairs = (first < second) & (rise > DEEP) & (bodies[first] != bodies[second])
    fromto, seen = np.zeros(6), set()
    for one, other in zip(solid[first[pairs]].tolist(), solid[second[pairs]].tolist(), strict=True):
        distance = mujoco.mj_geomDistance(model, data, one, other, 0.01, fromto)
        who = tuple(sorted(_owner(model, geom) for geom in (one, other)))
        if distance < -DEEP and who not in seen:
            seen.add(who)
            yield OutsideFinding("simulated overlap", who, -distance)


def _hanging(plan: WrittenPlan, model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[OutsideFinding]:
    """Objects below whose solids nothing solid follows within a gap; what hangs on a wall is left out.

    So are the pieces of an apparatus, which clamps and joints hold: tests/assets/test_apparatus.py.
    """
    groups = np.array([0, 0, 0, 1, 0, 0], dtype=np.uint8)
    hit = np.zeros(1, dtype=np.int32)
    for item in plan.items:
        if item.support == "wall" or plan.assembled(item.id, item.support):
            continue
        body = model.body(item.id).id
        below = []
        for point in _under(item):
            start = np.array([point[0], point[1], item.z + 1e-4])
            distance = mujoco.mj_ray(model, data, start, np.array([0.0, 0.0, -1.0]), groups, 1, body, hit)
            below.append(distance if distance >= 0.0 else np.inf)
        if min(below) > LOOSE_FIT:
            yield OutsideFinding("simulated support", (item.id,), float(min(below)))


def _under(item: WrittenItem) -> list[tuple[float, float]]:
    w, d = 0.4 * item.width, 0.4 * item.depth
    corners = item.rectangle(-w, w, -d, d).exterior.coords[:4]
    return [(item.x, item.y), *((x, y) for x, y in corners)]


def _owner(model: mujoco.MjModel, geom: int) -> str:
    body = int(model.geom_bodyid[geom])
    return model.body(body).name if body else model.geom(geom).name
