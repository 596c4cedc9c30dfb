"""Moving bodies of an interactive scene: drawers, doors and sashes on joints, castored and loose objects free."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import mujoco

from labgym.assets import Asset
from labgym.assets.archive import convex_bodies
from labgym.assets.articulation import (
    all_parts,
    fixed_solids,
    footing,
    joints,
    posed_part,
    posed_solid,
    values,
)
from labgym.assets.shapes import Part
from labgym.assets.shapes.joints import MECHANISMS, Joint
from labgym.geometry import OrientedBox, rotate
from labgym.layouts import Layout, Placement
from labgym.layouts.placement import FLOOR, WALL
from labgym.scenes.building import LEAF_DAMPING, LEAF_FORCE, LEAF_MASS, Leaf, leaves_of
from labgym.scenes.castors import about_z
from labgym.scenes.finishes import finishes_at, palette
from labgym.scenes.fittings import drawn_asset
from labgym.scenes.wall_openings import leaf_parts

if TYPE_CHECKING:
    from labgym.scenes.mjcf import SpecBuilder

ITEM_FRICTION = 0.5
"""Coefficient of sliding friction of objects on surfaces (assumption: glass and plastic on epoxy resin)."""
LEAST = 0.1
"""Least share of an asset's mass in its fixed part."""
ARMATURE = 0.01
"""Inertia added to each joint for numerical stability, kg or kg m²."""
DEGREE = math.degrees(1.0)
"""Degrees per radian: specifications have angles of joints in degrees, compiled models in radians."""
IMPRATIO = 10.0
"""Ratio of the impedances of friction and normal force: slow creep under a load below the limit of friction."""


def add_moving_scene(scene: SpecBuilder, layout: Layout, loose: bool = False) -> None:
    """Add the interior doors and all placements of a layout, with everything that moves on joints or free.

    Args:
        loose: whether objects on surfaces are free bodies; otherwise only those on something that is free.
    """
    option = scene.spec.option
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, IMPRATIO
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for leaf in leaves_of(layout.floor):
        _add_leaf(scene, leaf)
    bodies: dict[str, mujoco.MjsBody] = {}
    for placement in sorted(layout.placements, key=lambda each: _stand(layout, each) is not None):
        bodies[placement.id] = _add_placement(scene, layout, placement, bodies, loose)


def _stand(layout: Layout, placement: Placement) -> str | None:
    """Return the id of the stand that holds a piece of an apparatus; None for anything else."""
    stand = layout.apparatus(placement.id)
    return None if stand == placement.id else stand


def _friction(layout: Layout, placement: Placement, loose: bool) -> float | None:
    """Return the coefficient of friction of a placement that is a free body, None for one that is not."""
    if placement.support == FLOOR:
        foot = footing(layout.asset(placement.id))
        return None if foot is None else foot.friction
    if placement.support == WALL:
        return None
    if _stand(layout, placement) is not None:
        return None
    on_free = footing(layout.asset(layout.root(placement.id).id)) is not None
    return ITEM_FRICTION if loose or on_free else None


def _add_placement(
    scene: SpecBuilder, layout: Layout, placement: Placement, bodies: Mapping[str, mujoco.MjsBody], loose: bool
) -> mujoco.MjsBody:
    """Add a placement as a body with a child body for each of its joints, and return the body.

    A piece of an apparatus is fixed to its stand.
    """
    asset, friction = drawn_asset(layout, placement.id), _friction(layout, placement, loose)
    stand = _stand(layout, placement)
    if stand is None:
        body = scene.add_body(placement.id, placement.position, placement.yaw)
    else:
        base, (x, y, z) = layout.placement(stand), placement.position
        dx, dy = rotate(x - base.position[0], y - base.position[1], -base.yaw)
        local = [dx, dy, z - base.position[2]]
        body = bodies[stand].add_body(name=placement.id, pos=local, quat=about_z(placement.yaw - base.yaw))
    places = values(asset, placement.state)
    own = joints(asset)
    _set_inertia(body, asset, sum(joint.mass - MECHANISMS[joint.mechanism].content for joint in own.values()))
    if friction is not None:
        body.add_freejoint(name=placement.id)
    painted = palette(finishes_at(layout.floor, *placement.position[:2]))
    parts = [replace(part, material=painted.get(part.material, part.material)) for part in all_parts(asset)]
    for part in parts if scene.visible else ():
        if part.joint is None:
            scene.add_part(body, part)
    hulls = convex_bodies(asset)
    for k, (vertices, faces) in enumerate(hulls):
        scene.add_convex(body, f"{placement.id}/solid/{k}", vertices, faces)
    for k, solid in enumerate(() if hulls else fixed_solids(asset)):
        scene.add_solid(body, f"{placement.id}/solid/{k}", solid)
    for geom in body.geoms if friction is not None else ():
        if geom.name:  # the solids
            geom.priority, geom.friction = 1, [friction, 0.005, 0.0001]
    for name, joint in own.items():
        moving = [posed_part(part, places[name]) for part in parts if part.joint == joint]
        _add_joint(scene, body, f"{placement.id}/{name}", joint, places[name], moving)
    return body


def _add_joint(
    scene: SpecBuilder, parent: mujoco.MjsBody, name: str, joint: Joint, value: float, parts: Sequence[Part]
) -> None:
    """Add the moving part of a joint to the body of its asset; its coordinate is 0 where the part is closed."""
    body = parent.add_body(name=name)
    solid = posed_solid(joint, value)
    _set_box_inertia(body, solid, joint.mass)
    body.gravcomp = 1.0 if joint.balanced else 0.0
    for part in parts if scene.visible else ():
        scene.add_part(body, part)
    scene.add_solid(body, f"{name}/solid", solid)
    slides = joint.kind == "slide"
    kind = mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE
    unit = 1.0 if slides else DEGREE
    body.add_joint(
        name=name,
        type=kind,
        axis=joint.axis,
        pos=joint.origin,
        ref=value * unit,
        limited=True,
        range=[0.0, joint.travel * unit],
        damping=joint.damping,
        frictionloss=joint.friction,
        armature=ARMATURE,
    )
    scene.spec.add_exclude(bodyname1=parent.name, bodyname2=name)


def _add_leaf(scene: SpecBuilder, leaf: Leaf) -> None:
    """Add the leaf of an interior door; it collides with everything but the building."""
    box, width = leaf.box, leaf.box.width
    body = scene.add_body(leaf.name, (box.x, box.y, 0.0), box.yaw)
    local = OrientedBox(0.0, 0.0, width, box.depth, 0.0, box.z0, box.z1)
    _set_box_inertia(body, local, LEAF_MASS * width * (box.z1 - box.z0))
    for part in leaf_parts(width, box.depth, box.z1, "window_glass", leaf.material) if scene.visible else ():
        scene.add_part(body, part)
    scene.add_solid(body, f"{leaf.name}/solid", local)
    body.add_joint(
        name=leaf.name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0.0, 0.0, leaf.turn],
        pos=[*leaf.hinge, 0.0],
        ref=leaf.angle * DEGREE,
        limited=True,
        range=[0.0, leaf.travel * DEGREE],
        damping=LEAF_DAMPING * width * width,
        frictionloss=LEAF_FORCE * width,
        armature=ARMATURE,
    )
    scene.spec.add_exclude(bodyname1="world", bodyname2=leaf.name)


def _set_inertia(body: mujoco.MjsBody, asset: Asset, moving: float) -> None:
    """Set mass and inertia to those of a uniform bounding box, without the mass of the moving parts."""
    size, mass = asset.size, max(asset.mass - moving, LEAST * asset.mass)
    _set_box_inertia(body, OrientedBox(0.0, 0.0, size.width, size.depth, 0.0, 0.0, size.height), mass)


def _set_box_inertia(body: mujoco.MjsBody, box: OrientedBox, mass: float) -> None:
    w, d, h = box.width, box.depth, box.z1 - box.z0
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat = mass, [box.x, box.y, (box.z0 + box.z1) / 2.0], about_z(box.yaw)
    body.inertia = [mass / 12.0 * (a * a + b * b) for a, b in ((d, h), (w, h), (w, d))]
