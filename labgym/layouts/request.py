"""What a layout is generated from."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.assets import Catalog
from labgym.layouts.habits import Habits
from labgym.layouts.model import Room
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol


@dataclass(frozen=True)
class Request:
    """Everything that decides a generated layout.

    Attributes:
        seed: 0 to 2^53 - 1.
        catalog: source of every asset. habits: where furniture usually stands.
    """

    protocol: Protocol
    room: Room
    profile: Profile
    seed: int
    catalog: Catalog
    habits: Habits
