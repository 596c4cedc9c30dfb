"""Learners that lead drives of a dataset, so that its samples show where the learner goes astray."""

from __future__ import annotations

from typing import Protocol

from labgym.layouts import Layout
from labgym.policies.data.situations import Guide


class Leader(Protocol):
    """A learner that leads drives (DAgger, Ross, Gordon and Bagnell 2011). It is pickled and sent to workers."""

    @property
    def digest(self) -> str:
        """SHA-256 of everything that decides where it drives."""

    def guide(self, layout: Layout, seed: int) -> Guide:
        """Return the guide of drives in a layout; equal seeds give equal guides."""
