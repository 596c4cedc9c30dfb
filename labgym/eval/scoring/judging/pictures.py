"""The pictures that a judge sees: the floor from above, spaces from their corners, and places of work."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np

from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR
from labgym.navigation.clearance import Obstacles
from labgym.protocols import Protocol
from labgym.scenes.corners import corner_views
from labgym.scenes.tracing import trace_view
from labgym.scenes.views import TALL, View, picture_view

CORNERS = 4
"""Greatest number of corners from which pictures show all spaces together."""
BENCHES = 5
"""Greatest number of places of work that have a picture."""
WIDTH, HEIGHT, SAMPLES = 768, 432, 2
"""Size of a picture, pixels, and rays per pixel."""


@dataclass(frozen=True)
class Picture:
    """A named picture as PNG."""

    name: str
    png: bytes


def judged_views(layout: Layout, protocol: Protocol | None) -> dict[str, View]:
    """Return the cameras of the pictures by name: topdown, corners of the largest spaces, and places of work."""
    cameras = {"topdown": picture_view(layout, "topdown")}
    spaces = sorted(layout.floor.spaces, key=lambda space: (-space.area, space.id))[:CORNERS]
    tall = Obstacles(box for box in layout.obstacles(TALL) if box.z1 > TALL)
    share, more = divmod(CORNERS, len(spaces))
    for index, space in enumerate(spaces):
        for number, view in enumerate(corner_views(space, tall, share + (index < more)), 1):
            cameras[f"corner {number} of {space.id}"] = view
    for name in _workplaces(layout, protocol):
        cameras[name] = picture_view(layout, name)
    return cameras


def pictures(layout: Layout, protocol: Protocol | None) -> tuple[Picture, ...]:
    """Return the pictures of a layout for a judge, rendered without OpenGL."""
    return tuple(
        Picture(name, _png(trace_view(layout, view, WIDTH, HEIGHT, SAMPLES)))
        for name, view in judged_views(layout, protocol).items()
    )


def _workplaces(layout: Layout, protocol: Protocol | None) -> list[str]:
    """Return the furniture at which the protocol works, in its order, then the benches that carry the most."""
    standing = [p.id for p in layout.placements if p.support == FLOOR and layout.asset(p.id).surfaces]
    located = [layout.find(name) for name in (protocol.locations if protocol is not None else ())]
    names = [placement.id for placement in located if placement is not None and placement.id in standing]
    open_tops = [name for name in standing if layout.asset(name).storage_class is None]
    names += sorted(open_tops, key=lambda name: (-len(layout.children(name)), name))
    return list(dict.fromkeys(names))[:BENCHES]


def _png(pixels: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "png")
    return stream.getvalue()
