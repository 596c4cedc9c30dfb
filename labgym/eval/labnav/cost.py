"""The cost of an evaluation, printed before it starts."""

from __future__ import annotations

from labgym.eval.labnav.suites import ALL, LabNavSuite

SECONDS = {
    "still": 0.4, "straight": 0.3, "blind": 0.4, "bug2": 1.0, "astar": 0.6, "ppo": 1.0, "dwa": 3.0, "online_map": 6.0,
    "stack": 1.5, "local-imitation": 1.2, "local-ppo": 1.2, "clairvoyant": 2.0, "iplanner": 10.0, "navdp": 12.0,
}  # fmt: skip
"""CPU seconds of a drive by policy on one core: of the references as measured on floors-test, of ppo, dwa, online_map,
iplanner, navdp and the local planner estimated from a few drives."""


def cost(suite: LabNavSuite, policy: str) -> str:
    """Return a sentence on the episodes of a suite, and on the CPU time of a policy as far as it is known."""
    tasks = ", ".join(f"{part.task} {part.level}" for part in suite.parts)
    text = f"{suite.name}: {suite.count} episodes of at most {suite.seconds:g} s simulated ({tasks})"
    each = SECONDS.get(policy)
    text += "." if each is None else f"; about {_hours(suite.drives * each)} of CPU time for {policy}."
    missing = [task for task in ALL if task not in {part.task for part in suite.parts}]
    if suite.name == "labnav" and missing:
        text += f" Not published yet: {', '.join(missing)}; without them there is no figure LabNav."
    return text


def _hours(seconds: float) -> str:
    return f"{max(1.0, seconds / 60.0):.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
