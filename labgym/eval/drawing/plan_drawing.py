"""The parts of a top-down picture: room, furniture, what stands on it, goal poses and traces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.eval.drawing import palette
from labgym.eval.drawing.plan_labels import FONT, label_furniture
from labgym.geometry import OrientedBox
from labgym.layouts.model import FLOOR, WALL, Door, Layout, Room

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ON_TOP = 40
"""Drawing order from which traces and goal poses lie above every object."""


@dataclass(frozen=True)
class Trace:
    """A path to draw.

    Attributes:
        policy: whose path it is.
        points: (n, 2) positions of the robot's centre, metres, room frame.
        success: whether it arrived; a cross marks where it ended if not.
    """

    policy: str
    points: NDArray[np.float64]
    success: bool = True


def draw_room(axes: Axes, room: Room) -> None:
    """Draw floor, metre grid, walls and doors."""
    from matplotlib.patches import Rectangle

    wall = room.wall_thickness
    outer = Rectangle((-wall, -wall), room.width + 2 * wall, room.depth + 2 * wall, facecolor=palette.WALL, zorder=1)
    axes.add_patch(outer)
    axes.add_patch(Rectangle((0, 0), room.width, room.depth, facecolor=palette.FLOOR, zorder=2))
    for x in range(1, math.ceil(room.width)):
        axes.plot([x, x], [0, room.depth], color=palette.GRID, linewidth=0.6, zorder=3)
    for y in range(1, math.ceil(room.depth)):
        axes.plot([0, room.width], [y, y], color=palette.GRID, linewidth=0.6, zorder=3)
    for door in room.doors:
        _draw_door(axes, room, door)


def _draw_door(axes: Axes, room: Room, door: Door) -> None:
    """Draw the opening in the wall and the leaf, open at a right angle into the room, with its sweep."""
    from matplotlib.patches import Rectangle

    origin, along, inward = _wall_frame(room, door.wall)
    hinge = origin + (door.offset - door.width / 2.0) * along
    far = hinge + door.width * along
    gap = np.array([hinge, far - room.wall_thickness * inward])
    low, high = gap.min(axis=0), gap.max(axis=0)
    axes.add_patch(Rectangle((low[0], low[1]), *(high - low), facecolor="#ffffff", zorder=2))
    angles = np.linspace(0.0, math.pi / 2.0, 24)
    sweep = hinge + door.width * (np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * inward)
    axes.plot(*sweep.T, color=palette.DOOR, linewidth=0.7, linestyle=(0, (3, 2)), zorder=4)
    leaf = np.array([hinge, hinge + door.width * inward])
    axes.plot(*leaf.T, color=palette.DOOR, linewidth=2.0, solid_capstyle="butt", zorder=4)


def _wall_frame(room: Room, wall: str) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return a wall's start on the interior side, the direction of offsets along it, and the way into the room."""
    x, y = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    start = np.zeros(2)
    return {
        "front": (start, x, y),
        "back": (room.depth * y, x, -y),
        "left": (start, y, x),
        "right": (room.width * x, y, -x),
    }[wall]


def draw_objects(axes: Axes, layout: Layout, scale: float) -> None:
    """Draw placements, lower ones first, with front edges, names where they fit, and hazards.

    Of what is in storage cabinets only the reagents are shown.

    Args:
        scale: points of the picture that a metre takes, to fit names into furniture.
    """
    for placement in sorted(layout.placements, key=lambda p: (p.support != FLOOR, layout.box(p.id).z1, p.id)):
        asset, box = layout.asset(placement.id), layout.box(placement.id)
        if asset.kind == "reagent":
            _draw_reagent(axes, asset, box)
        elif placement.support == FLOOR:
            _draw_furniture(axes, asset, box)
        elif placement.support == WALL or layout.asset(placement.support).storage_class is None:
            _draw_item(axes, asset, box, hanging=placement.support == WALL)
    label_furniture(axes, layout, scale)


def _draw_furniture(axes: Axes, asset: Asset, box: OrientedBox) -> None:
    from matplotlib.patches import Polygon

    look = palette.swatch(asset)
    corners = box.corners()
    axes.add_patch(Polygon(corners, closed=True, facecolor=look.fill, edgecolor=look.edge, linewidth=0.8, zorder=8))
    # Corners 3 and 2 end the side that the object looks out of.
    front = np.array([corners[3], corners[2]])
    stripe = palette.STORAGE_COLOURS.get(asset.storage_class or "", look.edge)
    axes.plot(*front.T, color=stripe, linewidth=2.6, solid_capstyle="butt", zorder=9)


def _draw_item(axes: Axes, asset: Asset, box: OrientedBox, hanging: bool) -> None:
    from matplotlib.patches import Ellipse, Polygon

    look = palette.swatch(asset)
    edge = palette.HEAT if asset.heat_class else look.edge
    width = 1.1 if asset.heat_class else 0.6
    style = {"facecolor": look.fill, "edgecolor": edge, "linewidth": width, "zorder": 14 if not hanging else 16}
    if hanging:
        style |= {"facecolor": "none", "linestyle": (0, (2, 1.5))}
    if asset.hazards.glass_container and not hanging:
        axes.add_patch(Ellipse((box.x, box.y), box.width, box.depth, angle=math.degrees(box.yaw), **style))
    else:
        axes.add_patch(Polygon(box.corners(), closed=True, **style))


def _draw_reagent(axes: Axes, asset: Asset, box: OrientedBox) -> None:
    storage = asset.chemistry.storage_class if asset.chemistry else "General"
    edge = palette.FLAME if asset.hazards.flammable else "#ffffff"
    colour = palette.STORAGE_COLOURS[storage]
    axes.plot(box.x, box.y, "o", markersize=4.0, color=colour, markeredgecolor=edge, markeredgewidth=0.8, zorder=31)


def draw_traces(axes: Axes, traces: Sequence[Trace], colours: dict[str, str]) -> None:
    """Draw paths, later ones below earlier ones, a cross where one ended short of its goal."""
    for depth, policy in enumerate(colours):
        for trace in traces:
            if trace.policy != policy:
                continue
            order = ON_TOP + len(colours) - depth
            colour = colours[policy]
            width = 1.9 if depth == 0 else 1.2
            axes.plot(
                *trace.points.T,
                color="#ffffff",
                linewidth=width + 1.2,
                alpha=0.7,
                solid_capstyle="round",
                zorder=ON_TOP,
            )
            axes.plot(*trace.points.T, color=colour, linewidth=width, solid_capstyle="round", zorder=order)
            if not trace.success:
                axes.plot(*trace.points[-1], "x", color=colour, markersize=6, markeredgewidth=1.8, zorder=order)


def draw_goals(axes: Axes, poses: dict[str, tuple[float, float, float]]) -> None:
    """Draw numbered goal poses in the order of the mapping, an arrow along each heading."""
    for number, (x, y, yaw) in enumerate(poses.values(), start=1):
        tip = (x + 0.42 * math.cos(yaw), y + 0.42 * math.sin(yaw))
        arrow = {"arrowstyle": "-|>,head_width=0.22,head_length=0.4", "color": palette.INK, "linewidth": 1.3}
        axes.annotate("", xy=tip, xytext=(x, y), arrowprops=arrow | {"shrinkA": 0, "shrinkB": 0}, zorder=ON_TOP + 20)
        axes.plot(
            x,
            y,
            "o",
            markersize=11,
            color=palette.INK,
            markeredgecolor="#ffffff",
            markeredgewidth=1.0,
            zorder=ON_TOP + 21,
        )
        axes.text(
            x,
            y,
            str(number),
            fontsize=6.6,
            family=FONT,
            color="#ffffff",
            weight="bold",
            ha="center",
            va="center_baseline",
            zorder=ON_TOP + 22,
        )
