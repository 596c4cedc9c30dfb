"""LabFloorNavGoal-v0: goals that can be relabeled, for hindsight experience replay."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from labgym.envs.parts.goals import reached, sparse
from labgym.envs.point_nav import LabPointNavEnv


class LabFloorNavGoalEnv(LabPointNavEnv):
    """`LabFloorNav-v0` with the interface of Gymnasium-Robotics' goal environments, for hindsight experience replay.

    ## Observation space

    - `observation`, float32 (186,): pose (x, y in meters, room frame; cosine and sine of the yaw), velocity (m/s,
      rad/s) and lidar (180 ranges, meters).
    - `achieved_goal`, float32 (2,): position of the robot, meters, room frame.
    - `desired_goal`, float32 (2,): position of the goal.

    ## Reward

    -1 for every action that does not end within 0.36 m of the goal, else 0: `compute_reward(achieved_goal,
    desired_goal, info)`, which takes arrays of shape (..., 2) and does not read the info.

    ## Episode end

    `terminated` within 0.36 m of the goal, at any speed: the robot need not stop, because a relabeled goal is a
    position that it passed. `truncated` after 1500 steps.

    Arguments, reset options, action space and info are those of `LabFloorNav-v0`.
    """

    def compute_reward(self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Any) -> Any:  # noqa: ARG002
        """Return the reward of achieved for desired goals, float64 of shape (...).

        Args:
            achieved_goal, desired_goal: x and y, meters, shape (..., 2).
            info: is not read.
        """
        return sparse(achieved_goal, desired_goal)

    def compute_terminated(self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Any) -> Any:  # noqa: ARG002
        """Return whether goals are reached, bool of shape (...)."""
        return reached(achieved_goal, desired_goal)

    def compute_truncated(self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Any) -> bool:  # noqa: ARG002
        """Return False: only the time limit truncates."""
        return False
