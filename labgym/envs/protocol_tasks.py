"""Tasks of a whole protocol: all its drives in one episode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.envs.parts.protocols import Tasks
from labgym.envs.tasks import Task, goal_pair
from labgym.errors import OptionError
from labgym.navigation import goal_pairs


class ProtocolTasks:
    """Draws a task from a source and goes on to the end of its protocol.

    The first drive is the protocol's first, or that of the reset option "pair", an index into
    `goal_pairs(layout, protocol)`; the others follow in the protocol's order.

    Args:
        source: chooses layout and protocol.
    """

    def __init__(self, source: Tasks) -> None:
        self._source = source

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:
        """Return the next task.

        Raises:
            OptionError: the options name a start or a goal, or the layout has no protocol.
            UnknownNameError, DocumentError: as the source.
        """
        for name in ("start", "goal"):
            if options.get(name) is not None:
                raise OptionError(f"a whole protocol has no option {name!r}: its drives go from location to location")
        others = {name: value for name, value in options.items() if name != "pair"}
        task = self._source.draw(rng, others, fresh)
        index = 0 if options.get("pair") is None else options["pair"]
        first = goal_pair(task.layout, index, task.protocol)
        return replace(task, pair=first, following=goal_pairs(task.layout, task.protocol)[first.index + 1 :])

    def close(self) -> None:
        """Close the source."""
        self._source.close()
