"""Condition "people": people who walk between workplaces and stand there."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from labgym.envs.checks import count, positive
from labgym.envs.conditions.cast import MOST, Model, cast_of, draw_cast
from labgym.envs.parts.protocols import Condition, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.errors import OptionError, check_name


@registered("condition", "people")
class People(Condition):
    """People who walk between workplaces along shortest paths, stand there, and avoid each other.

    Some avoid the robot, too; the others do not see it until it has been at rest for 0.5 s. Nobody walks into a robot
    at rest. Touching a person counts while the robot moves: faster than 0.01 m/s. A round robot that turns on the spot
    takes no floor from anybody, and counts as at rest.

    Their data is that of `labgym.envs.conditions.cast.PeopleCast`. List this condition after those that change the
    layout.

    Attributes:
        density: people for each m2 of floor on which they can stand. group: number of people who walk together.
        yielding: share of people who avoid the robot while it moves. speed: m/s.
        model: "orca", or "social_force".
    """

    density: float = 1.0 / 8.0
    group: int = 1
    yielding: float = 0.5
    speed: float = 1.0
    model: Model = "orca"
    name: str = "people"

    def __post_init__(self) -> None:
        positive(self, "speed")
        positive(self, "density", "yielding", zero=True)
        count(self, "group")
        for name, most in (("density", 2.0), ("yielding", 1.0), ("speed", 3.0), ("group", MOST)):
            if getattr(self, name) > most:
                raise OptionError(f"People: {name} is {getattr(self, name)}, expected at most {most}")
        check_name("model of people", self.model, get_args(Model))

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, object]:
        """Return the people of an episode."""
        return draw_cast(task, rng, self.density, self.group, self.yielding, self.speed, self.model)

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Presence:  # noqa: ARG002
        """Return the people at their starts."""
        from labgym.envs.conditions.walking import Walking  # loads numba, which takes half a second

        cast = cast_of(data)
        for number, role in enumerate(cast.people):
            if not state.world.paths.free(*role.start):
                raise OptionError(
                    f"people: person {number + 1} starts at {role.start}, where a disc of 0.3 m does not fit: list the "
                    "condition after those that change the layout, or choose another start"
                )
        return Walking(state, cast)
