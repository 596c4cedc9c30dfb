"""Options of the NavDP-style policy."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from labgym.policies.options import PolicyOptions

Angle = Annotated[float, Field(ge=0.0)]
Length = Annotated[float, Field(ge=0.0)]
Steps = Annotated[int, Field(ge=1)]


class NavDPOptions(PolicyOptions):
    """How drawn trajectories become motion.

    Attributes:
        samples: number of trajectories drawn at a time.
        choose: "critic" follows the trajectory with the highest value, "first" the first one drawn.
        facing: an episode begins with a turn in place until the goal's bearing is within this angle, radians: the
            camera is 68 degrees wide and the goal may be behind.
        commit: distance for which a trajectory is followed before others are drawn, meters.
        commit_after_turn: the same for the first trajectory after a turn, which leads away from the goal.
        patience: control steps after which others are drawn in any case.
        shortest: shorter trajectories mean "stop", meters.
        stop: value below which no trajectory is safe and the robot turns in place; None never turns for that reason.
        turn_angle: angle of a turn before trajectories are drawn again, radians.
        turn_steps: control steps after which a turn ends in any case, because something may block it.
        stuck_steps, stuck_distance: the robot turns in place when it has moved less than `stuck_distance` meters over
            the last `stuck_steps` control steps.
        remembers: whether the network sees earlier frames. False shows the present frame in their place.
        veto: distances that a trajectory has to keep from all obstacles seen so far, meters, in order: the next one
            counts if no trajectory keeps the previous one. Empty follows trajectories by the critic's value alone.
        veto_ahead: length over which it has to keep that distance, meters.
        redraws: further draws if no trajectory is clear.
        guided: number of denoising steps, from the end, in which trajectories are pushed away from the obstacles seen.
        margin: distance from which they push, meters.
        check: distances that the robot has to keep from the obstacles seen in the next control steps, braking included,
            meters, in order: it slows down to do so, and draws other trajectories if only a later distance can be kept.
            It stops if none can. Empty follows the trajectory unchecked.
        settled: turn rate below which the robot sets off after a turn in place, rad/s: faster, it would leave its path.
            None sets off at once.
    """

    samples: Steps = 12
    choose: Literal["critic", "first"] = "critic"
    facing: Angle = 0.5
    commit: Length = 0.5
    commit_after_turn: Length = 1.2
    patience: Steps = 20
    shortest: Length = 0.5
    stop: float | None = -1.5
    turn_angle: Angle = 0.5
    turn_steps: Steps = 12
    stuck_steps: Steps = 30
    stuck_distance: Length = 0.10
    remembers: bool = True
    veto: tuple[Length, ...] = (0.42, 0.36, 0.30)
    veto_ahead: Length = 1.2
    redraws: Annotated[int, Field(ge=0)] = 2
    guided: Annotated[int, Field(ge=0)] = 4
    margin: Length = 0.45
    check: tuple[Length, ...] = (0.36, 0.28)
    settled: Angle | None = 0.5

    @property
    def maps(self) -> bool:
        """Whether any part looks at the obstacles seen so far."""
        return bool(self.veto) or bool(self.check) or self.guided > 0
