"""The policies of a server, one per robot."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.counts import is_whole
from labgym.errors import LabgymError, one_line
from labgym.policies.http.requests import finite_numbers, frames_of
from labgym.policies.http.served import ServedPolicy, blank_frame
from labgym.policies.http.wire import WireError, paths_of
from labgym.policies.policy import GoalKind, Policy

MAX_BATCH = 16
"""Largest number of robots of one server."""
NO_CAMERA = "the camera is unknown; call /navigator_reset first"


class UnsupportedStepError(LabgymError):
    """A step with a kind of goal to which the policy cannot drive."""


class Fleet:
    """The policies of one server; one request at a time uses them.

    Args:
        make: returns a new policy.
        seed: random seed of the policies.

    Raises:
        LabgymError: the policy needs the map, or fails on an empty frame.
    """

    def __init__(self, make: Callable[[], Policy], seed: int) -> None:
        self._make, self._lock = make, threading.Lock()
        self._seed = np.random.SeedSequence(seed)
        self._intrinsic: NDArray[np.float64] | None = None
        first = make()
        if first.privileged or first.foresees:
            raise LabgymError(f"policy {first.name!r} cannot be served: it needs the map, which clients do not send")
        self.name, self._kinds = first.name, tuple(first.goal_kinds)
        served = ServedPolicy(first, self._seed.spawn(1)[0])
        try:
            served.trajectory(blank_frame(self._kinds[0]))
        except Exception as error:
            first.close()
            raise LabgymError(f"policy {first.name!r} cannot be served: {one_line(error, 400)}") from error
        served.forget()
        self._robots = [served]

    def reset(self, content: dict[str, Any]) -> None:
        """Set the camera and the number of robots, and start new episodes.

        Raises:
            WireError: the content is not that of /navigator_reset.
        """
        intrinsic = finite_numbers(content.get("intrinsic"), "intrinsic")
        if intrinsic.shape not in ((3, 3), (4, 4)) or intrinsic[0, 0] <= 0.0 or intrinsic[1, 1] <= 0.0:
            raise WireError("intrinsic is not a camera matrix of 3 x 3 with focal lengths above 0")
        batch = content.get("batch_size", 1)
        if not is_whole(batch) or not 1 <= batch <= MAX_BATCH:
            raise WireError(f"batch_size is {str(batch)[:40]}, expected a whole number from 1 to {MAX_BATCH}")
        with self._lock:
            while len(self._robots) > batch:
                self._robots.pop().close()
            while len(self._robots) < batch:
                self._robots.append(ServedPolicy(self._make(), self._seed.spawn(1)[0]))
            for robot in self._robots:
                robot.forget()
            self._intrinsic = intrinsic[:3, :3]

    def reset_one(self, content: dict[str, Any]) -> None:
        """Start a new episode of one robot.

        Raises:
            WireError: there is no such robot, or no camera.
        """
        index = content.get("env_id")
        with self._lock:
            if self._intrinsic is None:
                raise WireError(NO_CAMERA)
            if not is_whole(index) or not 0 <= index < len(self._robots):
                raise WireError(f"env_id is {str(index)[:40]}, expected 0 to {len(self._robots) - 1}")
            self._robots[index].forget()

    def check(self, path: str, kind: GoalKind) -> None:
        """Check that the policy can drive to a kind of goal.

        Raises:
            UnsupportedStepError: it cannot.
        """
        if kind not in self._kinds:
            raise UnsupportedStepError(f"policy {self.name!r} has no {path}; it answers {paths_of(self._kinds)}")

    def step(self, kind: GoalKind, parts: dict[str, bytes]) -> dict[str, Any]:
        """Return the answer to a form.

        Raises:
            WireError: a part is missing or invalid, or there is no camera.
        """
        with self._lock:
            if self._intrinsic is None:
                raise WireError(NO_CAMERA)
            frames = frames_of(parts, kind, len(self._robots), self._intrinsic)
            trajectories = [robot.trajectory(frame) for robot, frame in zip(self._robots, frames, strict=True)]
        answer = np.stack(trajectories)
        return {
            "trajectory": answer.tolist(),
            "all_trajectory": answer[:, None].tolist(),
            "all_values": [[0.0]] * len(answer),
        }

    def close(self) -> None:
        """Close the policies."""
        with self._lock:
            while self._robots:
                self._robots.pop().close()
