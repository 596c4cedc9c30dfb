"""Off-screen pictures by MuJoCo's own renderer, in one thread for all; needs OpenGL."""

from __future__ import annotations

import os
import sys
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal, TypeVar, get_args

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.counts import check_address_space
from labgym.errors import LabgymError, OptionError, check_name
from labgym.layouts import Layout
from labgym.scenes.building import building_patches
from labgym.scenes.cutaway import hanging_on, hidden_walls
from labgym.scenes.fittings import installations
from labgym.scenes.ghosts import TOPS, blank_backs
from labgym.scenes.mesh import scene_mesh
from labgym.scenes.mjcf import COLLISION_GROUP, add_camera, to_mjcf
from labgym.scenes.surfaces import GHOST
from labgym.scenes.views import View, picture_view

Result = TypeVar("Result")

_executor: ThreadPoolExecutor | None = None
_starting = threading.Lock()
_here = threading.local()
_dropped: deque[mujoco.Renderer] = deque()
"""Renderers that nobody uses any more; the thread closes them before its next call."""
_inherited: list[object] = []
"""The thread and the renderers of the process that this one was forked from; they can be neither used nor closed."""
LARGEST = (2560, 1440)
"""Largest picture, pixels: the size of the off-screen buffer of compiled scenes."""
Quality = Literal["fast", "fine"]
"""fine: shadows, reflections and the model's visual settings; fast: a tenth of the time in software OpenGL."""

QUALITIES: tuple[Quality, ...] = get_args(Quality)
FEWEST_GEOMS, DECORATIONS = 20_000, 1_000
"""Least room for geoms in a renderer's scene, and room for what MuJoCo adds to those of the model. MuJoCo leaves out,
with a warning only, what exceeds the room."""
PICTURE = "/picture"
"""Name of the camera of a picture; no placement has such an id."""
FAST_SLICES, FAST_STACKS = 16, 10
"""Sides around and along a round geom in fast pictures."""

OPENGL_BYTES = 600e6
"""Address space of OpenGL in software, with a margin."""


def on_render_thread(function: Callable[..., Result], *arguments: Any) -> Result:
    """Return the result of a call that runs on the render thread, whichever thread asks for it.

    Raises:
        LabgymError: this process was forked from one that had drawn; OpenGL would hang.
        Exception: what the call raises.
    """
    if getattr(_here, "drawing", False):
        return function(*arguments)
    return _thread().submit(_called, function, arguments).result()


def drop(renderer: mujoco.Renderer, process: int) -> None:
    """Let the render thread close a renderer; this never waits, so that finalizers may call it.

    Args:
        process: id of the process that made the renderer; a process forked from it cannot close it.
    """
    (_dropped if process == os.getpid() else _inherited).append(renderer)


def _called(function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    _here.drawing = True
    while _dropped:
        _dropped.popleft().close()
    return function(*arguments)


def _thread() -> ThreadPoolExecutor:
    global _executor
    if _inherited:
        raise LabgymError(
            "this process was forked from one that had drawn pictures, and OpenGL works in one of them only: start it "
            "by 'spawn', or fork before the first picture"
        )
    with _starting:
        if _executor is None:
            _executor = ThreadPoolExecutor(1, thread_name_prefix="labgym render")
        return _executor


def _leave_behind() -> None:
    """In a forked process, keep what belongs to the other one from being used or closed."""
    global _executor, _starting
    if _executor is not None:
        _inherited.extend((_executor, *_dropped))
    _dropped.clear()
    _executor, _starting = None, threading.Lock()


os.register_at_fork(after_in_child=_leave_behind)


class MissingRendererError(LabgymError):
    """MuJoCo finds no usable OpenGL on this machine."""

    def __init__(self, reason: object) -> None:
        super().__init__(
            f"MuJoCo cannot render with OpenGL here ({' '.join(str(reason).split())[:200]}); install an OpenGL library "
            "(Debian: apt install libegl1 libgl1-mesa-dri), or use the traced renderer, which does not need it"
        )


def make_renderer(model: mujoco.MjModel, width: int, height: int, quality: Quality = "fine") -> mujoco.Renderer:
    """Return MuJoCo's off-screen renderer, using EGL if there is no display and MUJOCO_GL is not set.

    Close the renderer after use; it belongs to the thread that made it (`on_render_thread` has one for all).

    Args:
        model: the compiled scene; "fast" lowers its `vis.quality`.
        width, height: size of the pictures, pixels.
        quality: "fine", or "fast" without shadows, reflections and antialiasing, and with coarser round geoms.

    Raises:
        OptionError: the picture is larger than the model's off-screen buffer.
        UnknownNameError: the quality does not exist.
        MissingRendererError: OpenGL is not available.
    """
    check_name("quality", quality, QUALITIES)
    largest = (model.vis.global_.offwidth, model.vis.global_.offheight)
    if not (1 <= width <= largest[0] and 1 <= height <= largest[1]):
        raise OptionError(f"picture size {width}x{height} is not between 1x1 and the model's {largest[0]}x{largest[1]}")
    if quality == "fast":
        detail = model.vis.quality
        detail.offsamples, detail.numslices, detail.numstacks = 0, FAST_SLICES, FAST_STACKS
    check_address_space("OpenGL", OPENGL_BYTES)
    try:
        _prefer_egl()
        renderer = mujoco.Renderer(model, height, width, max_geom=max(FEWEST_GEOMS, model.ngeom + DECORATIONS))
    except (ImportError, AttributeError, OSError, RuntimeError, mujoco.FatalError) as error:
        raise MissingRendererError(error) from error
    for effect in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
        renderer.scene.flags[effect] = quality == "fine"
    return renderer


def render_opengl(layout: Layout, width: int = 1280, height: int = 720, camera: str = "overview") -> NDArray[np.uint8]:
    """Return a fine picture of a layout by MuJoCo's renderer, shape (height, width, 3).

    Args:
        camera: a name of `labgym.scenes.views.views`: overview, topdown, door, or a workplace's placement id.

    Raises:
        UnknownNameError: the camera does not exist.
        OptionError: larger than 2560 x 1440.
        MissingRendererError: OpenGL is not available.
    """
    return on_render_thread(_picture, layout, width, height, picture_view(layout, camera))


def _picture(layout: Layout, width: int, height: int, place: View) -> NDArray[np.uint8]:
    spec = to_mjcf(layout)
    add_camera(spec, PICTURE, place)
    model = spec.compile()
    hidden = hidden_walls(layout.floor, place.position)
    mounted = (patch for installation in installations(layout) for patch in installation.patches)
    for patch in (*building_patches(layout.floor), *mounted):
        if patch.wall in hidden:
            model.geom(patch.name).group = COLLISION_GROUP
    for placement in layout.placements:
        if hanging_on(layout, placement) in hidden:
            model.geom_group[model.geom_bodyid == model.body(placement.id).id] = COLLISION_GROUP
    backs = blank_backs(scene_mesh(layout, hidden), layout, place.position, hidden) if hidden else ()
    for index in backs:
        ghost = layout.placements[index].id
        if layout.box(ghost).z1 > TOPS[1]:
            parts = model.geom_bodyid == model.body(ghost).id
            model.geom_rgba[parts, :3] = model.mat_rgba[model.geom_matid[parts], :3]
            model.geom_rgba[parts, 3] = 2.0 * GHOST
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with make_renderer(model, width, height) as renderer:
        renderer.update_scene(data, camera=PICTURE)
        picture: NDArray[np.uint8] = renderer.render().copy()
    return picture


def _prefer_egl() -> None:
    """Make MuJoCo use EGL on a Linux machine without a display, unless MUJOCO_GL is set.

    MuJoCo chose its backend when it was imported; this replaces the choice.
    """
    displays = ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")
    if sys.platform == "linux" and not any(os.environ.get(name) for name in displays):
        from mujoco.egl import GLContext
        from mujoco.rendering.classic import gl_context

        gl_context.GLContext = GLContext
