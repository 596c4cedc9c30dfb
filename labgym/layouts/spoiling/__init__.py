"""Thirty-nine ways to spoil a layout that is in order, for tests of metrics and judges.

Each must lower a headline figure of touchstone-v2 (docs/metrics.md). Deterministic; any floor. The damage that repairs
are evaluated with, drawn at random, is in `labgym.layouts.damage`.
"""

from labgym.layouts.spoiling.spoilings import SPOILINGS, Spoiling

__all__ = ["SPOILINGS", "Spoiling"]
