"""Pictures of the robot from behind and above."""

from __future__ import annotations

import math
import os
import weakref
from collections.abc import Sequence
from typing import Any

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.assets.shapes import MATERIALS
from labgym.envs.assembly import STATIC, Moving
from labgym.envs.conditions.bodies import Body, BodyShape
from labgym.envs.mount import attach
from labgym.envs.parts.protocols import Robot
from labgym.envs.parts.robots import DifferentialDrive
from labgym.envs.physics import Physics
from labgym.envs.robot import PREFIX
from labgym.envs.scene_simulation import SceneSimulation
from labgym.envs.simulation import Pose
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.navigation.clearance import Obstacles
from labgym.scenes import Quality, RayScene, SceneMesh, make_renderer, to_mjcf
from labgym.scenes.batches import batched_spec, in_view
from labgym.scenes.building import building_patches
from labgym.scenes.cutaway import across
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM
from labgym.scenes.mjcf import VISUAL_GROUP
from labgym.scenes.opengl import LARGEST, drop, on_render_thread

NAME = "/condition"
"""Beginning of the names of bodies and meshes; no placement has such an id."""


def add_shapes(spec: mujoco.MjSpec, shapes: Sequence[BodyShape]) -> None:
    """Add a body without contacts for each shape, to be placed with `place_bodies`."""
    meshes: dict[tuple[int, int], str] = {}
    for number, shape in enumerate(shapes):
        body = spec.worldbody.add_body(name=f"{NAME}/{number}", mocap=True)
        for material in np.unique(shape.mesh.material).tolist():
            name = meshes.setdefault((id(shape), material), f"{NAME}/{len(meshes)}")
            if spec.mesh(name) is None:
                corners, faces = np.unique(shape.mesh.faces[shape.mesh.material == material], return_inverse=True)
                mesh = spec.add_mesh(name=name)
                mesh.uservert = shape.mesh.vertices[corners].astype(np.float32).ravel()
                mesh.userface = faces.astype(np.int32).ravel()
                mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=name,
                rgba=MATERIALS[MATERIAL_NAMES[material]].rgba,
                group=VISUAL_GROUP,
                contype=0,
                conaffinity=0,
            )


def place_bodies(data: mujoco.MjData, bodies: Sequence[Body]) -> None:
    """Put bodies at their poses, in a scene with their shapes in this order; `mj_forward` takes effect."""
    for number, body in enumerate(bodies):
        mocap = data.model.body(f"{NAME}/{number}").mocapid[0]
        x, y, yaw = body.pose
        data.mocap_pos[mocap] = x, y, 0.0
        data.mocap_quat[mocap] = math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)


DISTANCE = 3.6
"""Distance from the camera to the point that it looks at, meters."""

STATIONS = (
    *(
        (math.radians(aside), math.radians(pitch))
        for pitch in (38.0, 58.0, 78.0)
        for aside in (25.0, -25.0, 0.0, 60.0, -60.0)
    ),
    (0.0, math.radians(87.0)),
)
"""Candidate camera positions, best first: angle to the right of straight behind, and angle below the horizontal."""

SEEN = (0.15, 0.7, 1.25)
"""Heights on the robot's axis that furniture should not hide, meters."""

LEAF_GAP_M = 0.02
"""Least distance from the walls of what is not a wall but part of an open door, meters."""

FACES_PASSED, NUDGE_M = 6, 0.01
"""Number of faces of walls that a line of sight passes, and the distance behind one at which it goes on, meters."""

AHEAD, LOOK_AT_HEIGHT = 0.5, 0.6
"""The point that the camera looks at: its distance ahead of the robot and its height above the floor, meters."""

FOVY = 55.0
"""Vertical field of view, degrees."""

OVERSAMPLING = 1.25
"""Samples of a fast picture's pixel along each axis; averaging them costs less than OpenGL's antialiasing."""

STANDARD = DifferentialDrive()
"""The differential robot."""

SHADOW_RADII_M, SHADOW_STEP_M = (0.37, 0.34, 0.31), 0.003
"""Radii of the discs of a contact shadow, and the height of each above the one before."""
SHADOW_COLOR = np.array([0.0, 0.0, 0.0, 0.1], dtype=np.float32)
FARTHEST_M = 1e6
"""Distance from the camera that a shadow is said to have, meters: all else that is transparent is before it."""

NOT_DRAWN = 5
"""Geom group that MuJoCo does not draw by default."""


class ChaseView:
    """A camera that follows the robot from a position where furniture does not hide it.

    The first picture of a layout compiles its scene and creates the renderer. Any thread may call it: the pictures of
    a process are drawn one after the other on a separate thread.

    Args:
        width, height: size of the pictures, pixels.
        quality: "fast", or "fine" with shadows and reflections, which takes about ten times as long without a GPU.
        robot: the robot. moving: what moves besides it.
    """

    def __init__(
        self, width: int, height: int, quality: Quality = "fast", robot: Robot = STANDARD, moving: Moving = STATIC
    ) -> None:
        self._size, self._quality = (width, height), quality
        self._robot, self._moving = robot, moving
        self._station = 0
        self._layout: Layout | None = None
        self._shapes: tuple[BodyShape, ...] = ()
        self._scene: mujoco.MjData | None = None
        self._renderer: mujoco.Renderer | None = None
        self._finalizer: weakref.finalize[Any, Any] | None = None
        self._process = os.getpid()

    def picture(
        self,
        layout: Layout,
        rays: RayScene,
        pose: Pose,
        simulation: Physics | None = None,
        bodies: Sequence[Body] = (),
    ) -> NDArray[np.uint8]:
        """Return a picture of the robot at a pose in a layout, shape (height, width, 3).

        Args:
            rays: the layout's visible scene.
            simulation: where wheels, arms and furniture are; None for where they are at rest.
            bodies: what conditions add, such as people; other shapes than in the last picture take a new scene.

        Raises:
            OptionError: the image is larger than the scene's off-screen buffer.
            MissingRendererError: OpenGL is not available.
            LabgymError: this process was forked from one that had drawn.
        """
        return on_render_thread(self._picture, layout, rays, pose, simulation, bodies)

    def _picture(
        self, layout: Layout, rays: RayScene, pose: Pose, simulation: Physics | None, bodies: Sequence[Body]
    ) -> NDArray[np.uint8]:
        shapes = tuple(body.shape for body in bodies)
        if self._renderer is None or self._scene is None or self._layout is not layout or self._shapes != shapes:
            self._close()
            model = _scene(layout, rays.mesh, self._quality, self._robot, self._moving, shapes)
            self._layout, self._shapes, self._scene = layout, shapes, mujoco.MjData(model)
            self._renderer = self._new_renderer(model)
            self._process = os.getpid()
            self._finalizer = weakref.finalize(self, drop, self._renderer, self._process)
            self._finalizer.atexit = False
        hidden = _hidden(layout, rays, pose)
        if hidden[self._station] > 0:
            self._station = int(hidden.argmin())
        camera = _camera(pose, STATIONS[self._station])
        model, data = self._scene.model, self._scene
        _place(data, pose, simulation, bodies)
        groups = model.geom_group.copy()
        model.geom_group[_walls_between(layout, model, pose, camera)] = NOT_DRAWN
        if self._quality == "fast" and not self._moving.interactive:
            model.geom_group[~in_view(model, data, camera, self._size[0] / self._size[1])] = NOT_DRAWN
        self._renderer.update_scene(data, camera)
        model.geom_group[:] = groups
        if self._quality == "fast":
            walking = [body.pose for body in bodies if body.name.startswith("person")]
            for x, y, _ in (pose, *walking):
                _add_contact_shadow(self._renderer.scene, x, y)
        if self._quality == "fine":
            return np.array(self._renderer.render(), dtype=np.uint8)
        return np.asarray(cv2.resize(self._renderer.render(), self._size, interpolation=cv2.INTER_AREA), dtype=np.uint8)

    def _new_renderer(self, model: mujoco.MjModel) -> mujoco.Renderer:
        width, height = self._size
        if self._quality == "fine":
            return make_renderer(model, width, height, "fine")
        if not (0 < width <= LARGEST[0] and 0 < height <= LARGEST[1]):
            raise OptionError(f"picture size {width}x{height} is not between 1x1 and {LARGEST[0]}x{LARGEST[1]}")
        buffer = model.vis.global_
        buffer.offwidth, buffer.offheight = math.ceil(width * OVERSAMPLING), math.ceil(height * OVERSAMPLING)
        return make_renderer(model, buffer.offwidth, buffer.offheight, "fast")

    def __getstate__(self) -> dict[str, Any]:
        # The renderer stays in its process; a copy creates its own for its next image.
        absent = {"_layout": None, "_shapes": (), "_scene": None, "_renderer": None, "_finalizer": None}
        return {**self.__dict__, **absent}

    def close(self) -> None:
        """Free the renderer; the next picture creates a new one."""
        if self._renderer is not None and self._process == os.getpid():
            on_render_thread(self._close)

    def _close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
        if self._finalizer is not None:
            self._finalizer.detach()
        self._layout = self._scene = self._renderer = self._finalizer = None


def _scene(
    layout: Layout, mesh: SceneMesh, quality: Quality, robot: Robot, moving: Moving, shapes: Sequence[BodyShape]
) -> mujoco.MjModel:
    """Return a layout with the robot, used for drawing only."""
    if moving.interactive:
        spec = to_mjcf(layout, interactive=True, loose=moving.loose)
    else:
        spec = to_mjcf(layout) if quality == "fine" else batched_spec(layout, mesh)
    attach(spec, robot)
    add_shapes(spec, shapes)
    spec.visual.global_.fovy = FOVY
    return spec.compile()


def _place(data: mujoco.MjData, pose: Pose, simulation: Physics | None, bodies: Sequence[Body]) -> None:
    """Put the robot and everything that moves where it is in a simulation, by the names of joints."""
    model = data.model
    mujoco.mj_resetData(model, data)
    if isinstance(simulation, SceneSimulation):
        source = simulation.data
        for joint in range(model.njnt):
            name = model.joint(joint).name
            data.joint(name).qpos[:] = source.joint(name).qpos
    else:
        for name, value in zip(("x", "y", "yaw"), pose, strict=True):
            data.joint(PREFIX + name).qpos[0] = value
    place_bodies(data, bodies)
    mujoco.mj_forward(model, data)


def _add_contact_shadow(scene: mujoco.MjvScene, x: float, y: float) -> None:
    """Darken the floor under something, more in the middle; a fast picture has no other shadow."""
    for number, radius in enumerate(SHADOW_RADII_M[: scene.maxgeom - scene.ngeom]):
        size, place = (radius, SHADOW_STEP_M / 4.0, 0.0), (x, y, SHADOW_STEP_M * (number + 1))
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CYLINDER, size, place, np.eye(3).ravel(), SHADOW_COLOR)
        # `mjv_initGeom` leaves these fields as the last picture set them; transparent geoms are sorted by `camdist`.
        geom.category, geom.transparent, geom.camdist = mujoco.mjtCatBit.mjCAT_DECOR, 1, FARTHEST_M - scene.ngeom
        geom.objtype, geom.objid, geom.segid = mujoco.mjtObj.mjOBJ_UNKNOWN, -1, -1
        scene.ngeom += 1


def _camera(pose: Pose, station: tuple[float, float]) -> mujoco.MjvCamera:
    aside, pitch = station
    camera = mujoco.MjvCamera()
    camera.lookat = _looked_at(pose)
    camera.distance, camera.azimuth, camera.elevation = DISTANCE, math.degrees(pose[2] + aside), -math.degrees(pitch)
    return camera


def _walls_between(layout: Layout, model: mujoco.MjModel, pose: Pose, camera: mujoco.MjvCamera) -> list[int]:
    """Return the geoms of the upper parts of the walls between the camera and the robot."""
    floor = layout.floor
    azimuth = math.radians(camera.azimuth)
    level = camera.distance * math.cos(math.radians(camera.elevation))
    eye = camera.lookat[0] - level * math.cos(azimuth), camera.lookat[1] - level * math.sin(azimuth), 0.0
    hidden = across(floor, eye, np.array([pose[:2]]))
    return [model.geom(patch.name).id for patch in building_patches(floor) if patch.wall in hidden]


def _looked_at(pose: Pose) -> tuple[float, float, float]:
    x, y, yaw = pose
    return x + AHEAD * math.cos(yaw), y + AHEAD * math.sin(yaw), LOOK_AT_HEIGHT


def _hidden(layout: Layout, rays: RayScene, pose: Pose) -> NDArray[np.int64]:
    """Return, for each station, how many heights of `SEEN` furniture or an open door hides; walls are cut away."""
    target = np.array(_looked_at(pose))
    bearing = np.array([pose[2] + aside for aside, _ in STATIONS])
    pitch = np.array([pitch for _, pitch in STATIONS])
    back = np.column_stack([-np.cos(bearing) * np.cos(pitch), -np.sin(bearing) * np.cos(pitch), np.sin(pitch)])
    robot = np.array([(pose[0], pose[1], height) for height in SEEN])
    sight = (target + DISTANCE * back)[:, None, :] - robot[None, :, :]
    length = np.linalg.norm(sight, axis=-1)
    directions = (sight / length[..., None]).reshape(-1, 3)
    start, left = np.broadcast_to(robot, sight.shape).reshape(-1, 3), length.ravel()
    walls, blocked = Obstacles(wall.box for wall in layout.floor.walls), np.zeros(len(left), dtype=np.bool_)
    for _ in range(FACES_PASSED):
        distances, faces = rays.cast(start, directions, 2.0 * DISTANCE)
        struck = (distances < left) & (faces >= 0)
        start = start + np.where(struck, distances, 0.0)[:, None] * directions
        building = (rays.mesh.owner[faces] == ROOM) & (walls.nearest(start[:, :2]) <= LEAF_GAP_M)
        blocked |= struck & ~building
        start, left = start + NUDGE_M * directions, np.where(struck & building, left - distances - NUDGE_M, 0.0)
    counts: NDArray[np.int64] = blocked.reshape(length.shape).sum(axis=1)
    return counts
