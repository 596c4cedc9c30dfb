"""Pages of the environment ids: picture, spaces, reward, ending, limit, and what has learned them."""

from __future__ import annotations

from collections.abc import Iterator

import gymnasium as gym
from gymnasium import spaces

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.config import PointNavConfig
from labgym.envs.labnav.tasks import TASKS
from labgym.envs.presets import configured, labnav_id
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.leaderboard.labnav import published_results
from labgym.eval.leaderboard.tables import KNOWLEDGE
from labgym.table import Table

SUMMARIES = {
    "LabPointNav-v0": "Drive from one protocol step to the next in one room, the paper's task.",
    "LabFloorNav-v0": "Arrive and stop on a floor of several rooms, with a lidar.",
    "LabFloorNavDepth-v0": "Arrive and stop on a floor of several rooms, with a depth camera.",
    "LabFloorNavRGBD-v0": "Arrive and stop on a floor of several rooms, with color and depth images.",
    "LabFloorNavDiscrete-v0": "Arrive and say STOP on a floor, by steps of 0.25 m and turns of 15 degrees.",
    "LabFloorNavGoal-v0": "Reach goals that can be relabeled, for hindsight experience replay.",
    "LabProtocolNav-v0": "Drive all drives of a protocol in one episode.",
}
ROOM = "A room from above: its protocol's route, and the routes of six policies", "topdown.png"
FLOOR = "A floor of several rooms in the viewer: the robot, its plan, its camera and its depth image", "viewer.jpg"
PICTURES = {"LabPointNav-v0": ROOM, "LabProtocolNav-v0": ROOM}
"""Text and name of the picture of the ids that are no task of LabNav; by default that of a floor."""
TASKS_LEARNED = (
    "`local-ppo` learned all eight tasks at once, as the local planner of `stack`: 34 minutes of PPO "
    "([card](../../policies/local-ppo/CARD.md)) after 46 minutes of imitation "
    "([card](../../policies/local-imitation/CARD.md)). "
)
NO_TASK_LEARNED = (
    "No training from end to end is published that has learned this id ([Learn LabNav end to end](../learn.md))."
)
AISLE = (
    "End to end, `lidar-lstm` learned it in part by 40 minutes of imitation on one core: success in 0.66 and 0.68 of "
    "the drives of level 2 on floors-val with two seeds, 0.88 at level 1 ([Learn LabNav end to end](../learn.md))."
)
LEARNED = {
    "LabNavAisle-v0": TASKS_LEARNED + AISLE,
    "LabPointNav-v0": "`ppo` reaches a success rate of 0.992 in rooms that it has not seen, after a million steps, "
    "5 minutes on two cores ([training](../training.md#what-to-expect)).",
    "LabFloorNav-v0": "`ppo` trained in rooms reaches 0.875 in rooms after 524,288 steps, 7 minutes on two cores, and "
    "0.43 on floors ([training](../training.md#arrive-and-stop)).",
}
NOTHING = "No training is published that has learned this id."
BEST = 5
"""Policies of the published results on a page."""
REWARDS = {
    "progress": "for each meter by which the shortest path of the 0.30 m disc to the goal became shorter",
    "success": "when the drive ends in success",
    "collision": "for each action during which the robot touched something",
    "failure": "when the drive ends otherwise: by a contact that counts, stuck, or at rest elsewhere{drives}",
    "time": "for each action",
    "goal": "0 for each action that ends within 0.36 m of the goal, -1 for each other",
}
"""When an id gives a reward, by term."""
RULES = {
    "touch": "success within {radius:g} m of the goal, at any speed",
    "rest": "success at rest within {radius:g} m of the goal",
    "goal": "success within {radius:g} m of the goal, at any speed",
    "stop": "at the brake or STOP: success within {radius:g} m of the goal, failure elsewhere",
    "contact": "failure when the robot touches something, in `moved` and `shift` unless it can be pushed",
    "stuck": "failure after {duration:g} s within a disc of {radius:g} m; time near people does not count",
    "spill": "failure when liquid runs over the rim",
    "time": "failure when a drive has taken {duration:g} s",
}
"""When a rule ends a drive, by its name."""


def id_page(name: str) -> str:
    """Return the page of an id."""
    config, environment = configured(name, {}), gym.make(name)
    task = next((task for task in TASKS if labnav_id(task) == name), "")
    words, picture = (task, f"labnav_{task}.jpg") if task else PICTURES.get(name, FLOOR)
    summary = f"{TASKS[task].summary.capitalize()}." if task else SUMMARIES[name]
    assert environment.spec is not None
    observation, action = environment.observation_space, environment.action_space
    parts = [
        f"# {name}",
        summary,
        f"![{words}](../pictures/{picture})",
        "```python\nimport gymnasium as gym\nimport labgym\n\n"
        f'env = gym.make("{name}"{", level=1" if task else ""})\nobservation, info = env.reset(seed=0)\n```',
        "## Spaces",
        Table("", ("Observation", "Type", "Shape", "Range"), tuple(_rows(observation))).markdown(),
        f"Action: `{action}`. [Environments](../environment.md#observation-space) has their meaning and units.",
        "## Reward",
        reward_table(name),
        "## Episode end",
        Table("", ("Rule", "Meaning"), tuple(_endings(config))).markdown(),
        f"Truncated after {environment.spec.max_episode_steps} actions. Layouts are drawn from `{config.split}`.",
        *([_levels(task)] if task else []),
        "## What has learned it",
        LEARNED.get(name, TASKS_LEARNED + NO_TASK_LEARNED if task else NOTHING),
        *(_driven(task) if task else []),
    ]
    environment.close()
    return "\n\n".join(parts) + "\n"


def _rows(space: gym.Space[object]) -> Iterator[tuple[str, str, str, str]]:
    entries = space.spaces if isinstance(space, spaces.Dict) else {"": space}
    for name, entry in entries.items():
        assert isinstance(entry, spaces.Box)
        low, high = float(entry.low.min()), float(entry.high.max())
        yield f"`{name}`", str(entry.dtype), str(entry.shape), f"{low:g} to {high:g}"


def reward_table(name: str) -> str:
    """Return the table of the reward of an id."""
    config = configured(name, {})
    drives = ", and for each drive of the shift that is then not begun" if config.onward else ""
    rows = [
        (f"`{term.name}`", "" if term.name == "goal" else f"{term.weight:+g}", REWARDS[term.name].format(drives=drives))
        for term in config.reward_terms
        if term.weight
    ]
    return Table("", (f"`{name}`", "reward", "when"), tuple(rows)).markdown()


def _endings(config: PointNavConfig) -> Iterator[tuple[str, str]]:
    for ending in config.endings:
        yield f"`{ending.name}`", RULES[ending.name].format(**vars(ending))


def _levels(task: str) -> str:
    return (
        f"`level` is 0 to 3, by default 2; [the task](../labnav-tasks.md#{task}) has the parameters and score. "
        'An episode ends by the evaluator\'s brake near the announced goal; `stop="action"` adds a STOP to the action.'
    )


def _driven(task: str) -> Iterator[str]:
    results = [one for one in published_results() if any(part.task == task for part in one.summary.tasks)]
    scores = [(next(part for part in one.summary.tasks if part.task == task), one) for one in results]
    scores.sort(key=lambda pair: -(pair[0].score.value or 0.0))
    rows = tuple(
        (one.summary.policy, KNOWLEDGE[one.summary.track], estimate_text(part.score, 3), estimate_text(part.success, 3))
        for part, one in scores[:BEST]
    )
    yield "The best published policies in the test of this task, level 2 ([all](../results.md)):"
    yield Table("", ("Policy", "Knows", "Score", "Success"), rows).markdown()
