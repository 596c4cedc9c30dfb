"""Ways to spoil a layout that is in order, for tests of metrics and judges: 39 fixed ones, five kinds drawn at random.

Each fixed one must lower a headline figure of the rule set `touchstone` (docs/metrics.md), each drawn one breaks a
safety rule. Any floor. The damage that repairs are evaluated with, drawn at random, is in `labgym.paper.damage`.
"""

from spoiling.drawn import DRAWN, DrawnSpoiling
from spoiling.spoilings import SPOILINGS, Spoiling

__all__ = ["DRAWN", "SPOILINGS", "DrawnSpoiling", "Spoiling"]
