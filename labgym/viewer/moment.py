"""Messages to the page: the robot, its sensors and the counts of the episode at one control step."""

from __future__ import annotations

import base64
from dataclasses import asdict, dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.envs.sensors import RANGE, Camera, Lidar
from labgym.envs.state import State
from labgym.envs.world import World
from labgym.eval.driving.episode_row import TransitionRow
from labgym.scenes.rays import RaySource

NEAREST_DEPTH_M = 0.2
"""Depth at the bright end of the depth image's scale, meters; the dark end is the sensor's range."""


@dataclass(frozen=True)
class Moment:
    """A control step, as the page receives it; meters, seconds, room frame.

    Attributes:
        phase: "driving"; "ready" before a person's first key; "finished" at the end.
        episode: number of the episode. attempt: number of drives begun so far.
        pose: x, y, yaw. distance: to the goal. touching: whether the robot touches something.
        goal: x, y, yaw of the drive in progress; None for that of the episode.
        lidar: ranges as in the environment's observation. color, depth: camera images, PNG in base64.
        result: outcome of the finished episode, and None before.
        bodies: what moves besides the robot: number of its shape, x, y, yaw. people: x, y, yaw of each person, and
            whether the person yields (1) or does not see the robot (0).
    """

    phase: str
    episode: int
    attempt: int
    pose: tuple[float, float, float]
    distance: float
    path_length: float
    time: float
    contacts: int
    touching: bool
    clearance: float
    lidar: tuple[float, ...]
    color: str
    depth: str
    paused: bool = False
    speed: float = 1.0
    result: dict[str, Any] | None = None
    bodies: tuple[tuple[int, float, float, float], ...] = ()
    people: tuple[tuple[float, float, float, int], ...] = ()
    goal: tuple[float, float, float] | None = None

    def record(self) -> dict[str, Any]:
        """Return the data of a message to the page."""
        return asdict(self)


NUMBERS = ("distance", "path_length", "time", "clearance")
"""Values of the environment that a moment has, rounded."""


class PageSenses:
    """The sensors whose readings the page shows, whatever the driver reads."""

    def __init__(self) -> None:
        self._lidar, self._camera = Lidar(), Camera()

    def moment(self, world: World, info: dict[str, Any], phase: str, episode: int, attempt: int) -> Moment:
        """Return the moment of an environment's info."""
        rays = world.visible, world.solid
        return self._moment(info, rays, bool(info["collision"]), phase=phase, episode=episode, attempt=attempt)

    def of_state(
        self,
        state: State,
        phase: str,
        episode: int,
        attempt: int,
        bodies: tuple[tuple[int, float, float, float], ...],
        people: tuple[tuple[float, float, float, int], ...],
    ) -> Moment:
        """Return the moment of an environment's state, with what moves besides the robot."""
        return self._moment(
            {name: getattr(state, name) for name in ("pose", *NUMBERS, "contacts")},
            (state.rays("visual"), state.rays("solid")),
            bool(state.touched),
            phase=phase,
            episode=episode,
            attempt=attempt,
            bodies=bodies,
            people=people,
            goal=(round(state.goal[0], 3), round(state.goal[1], 3), round(state.goal[2], 4)),
        )

    def _moment(
        self, values: dict[str, Any], rays: tuple[RaySource, RaySource], touching: bool, **others: Any
    ) -> Moment:
        """Return a moment from values of the environment, and from what the camera and the lidar see."""
        x, y, yaw = (float(value) for value in values["pose"])
        color, depth = self._camera.colour_and_depth(rays[0], (x, y, yaw))
        numbers: dict[str, Any] = {name: round(float(values[name]), 3) for name in NUMBERS}
        return Moment(
            pose=(round(x, 4), round(y, 4), round(yaw, 4)),
            contacts=int(values["contacts"]),
            touching=touching,
            lidar=tuple(np.round(self._lidar.scan(rays[1], (x, y, yaw)).astype(float), 3).tolist()),
            color=_png(color[..., ::-1]),
            depth=_png(_shades(depth)),
            **numbers,
            **others,
        )


def outcome(row: TransitionRow) -> dict[str, Any]:
    """Return what the page shows of a finished episode."""
    names = ("success", "spl", "soft_spl", "contacts", "path_length", "shortest_path_length", "final_distance", "time")
    return {**{name: getattr(row, name) for name in names}, "error": row.error}


def _shades(depth: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return a depth image in color, near bright and far dark, in BGR."""
    near = np.log(RANGE / np.clip(depth, NEAREST_DEPTH_M, RANGE)) / np.log(RANGE / NEAREST_DEPTH_M)
    return np.asarray(cv2.applyColorMap(np.rint(near * 255.0).astype(np.uint8), cv2.COLORMAP_VIRIDIS), dtype=np.uint8)


def _png(image: NDArray[np.uint8]) -> str:
    """Return an image (rows, columns, 3) in BGR as PNG in base64."""
    return base64.b64encode(cv2.imencode(".png", np.ascontiguousarray(image))[1].tobytes()).decode()
