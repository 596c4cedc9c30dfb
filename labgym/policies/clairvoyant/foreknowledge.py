"""The knowledge of a clairvoyant robot: its world as it is and will be."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from labgym.navigation import FloorPlan


class Foreknowledge(Protocol):
    """The true layout, and people at any time of the episode."""

    def solids(self) -> FloorPlan:
        """Return the layout as it is, with all that has been moved, panes included."""
        ...

    def people(self, time: float) -> NDArray[np.float64]:
        """Return the centers of all people at a time of the episode, seconds; (n, 2) meters in the room frame."""
        ...
