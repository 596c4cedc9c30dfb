"""The cost of an evaluation, printed before it starts."""

from __future__ import annotations

from labgym.envs.labnav.tasks import FIGURE_TASKS
from labgym.eval.labnav.suites import LabNavSuite

SECONDS = {
    "still": 0.5, "straight": 0.25, "blind": 0.4, "bug2": 0.7, "astar": 0.4, "ppo": 0.5, "dwa": 1.0, "online_map": 4.0,
    "stack": 1.1, "local-imitation": 0.7, "local-ppo": 0.7, "clairvoyant": 2.5, "iplanner": 2.5, "navdp": 20.0,
    "ppo-depth": 3.0,
}  # fmt: skip
"""CPU seconds of a drive by policy on one core, with the processes of the policies: measured in carry; of online_map,
iplanner, ppo-depth and navdp in labnav-60, from the time that two cores took; of clairvoyant estimated."""


def cost(suite: LabNavSuite, policy: str) -> str:
    """Return a sentence on the episodes of a suite, and on the CPU time of a policy as far as it is known."""
    tasks = ", ".join(f"{part.task} {part.level}" for part in suite.parts)
    text = f"{suite.name}: {suite.count} episodes of at most {suite.seconds:g} s simulated ({tasks})"
    each = SECONDS.get(policy)
    text += "." if each is None else f"; about {_hours(suite.drives * each)} of CPU time for {policy}."
    missing = [task for task in FIGURE_TASKS if task not in {part.task for part in suite.parts}]
    if suite.name == "labnav" and missing:
        text += f" Not published yet: {', '.join(missing)}; without them there is no figure LabNav."
    return text


def _hours(seconds: float) -> str:
    return f"{max(1.0, seconds / 60.0):.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
