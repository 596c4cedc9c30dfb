"""A laboratory small enough to compute by hand, and an empty room of the same size."""

from __future__ import annotations

import pytest
from laboratories import island_laboratory

from labgym.layouts import Layout


@pytest.fixture(scope="session")
def layout() -> Layout:
    return island_laboratory()


@pytest.fixture(scope="session")
def empty_room(layout: Layout) -> Layout:
    """The same room without placements, doors and protocols."""
    room = layout.room.model_copy(update={"doors": ()})
    return Layout(id="empty", floor=room.floor, placements=())
