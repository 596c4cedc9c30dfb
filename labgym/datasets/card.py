"""The card of a dataset, README.md: what it holds, how it was made, and its limits."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence

from labgym.datasets.options import POINT, TRAINING_SPLITS, DriveOptions
from labgym.datasets.shard import Attempt, mean
from labgym.policies.registry import BUILT_IN

SEES = {
    "map": "the map of the floor (in LabNav the old one, before things moved) and its own sensors",
    "world": "the true floor, its true pose and where people will walk",
}
"""What experts receive that the observations do not hold, by `PolicyEntry.sees`."""
READING = {
    "parquet": """import pandas as pd

steps, episodes = pd.read_parquet("steps"), pd.read_parquet("episodes.parquet")""",
    "minari": """import labgym, minari  # with this folder at $MINARI_DATASETS_PATH/{name}

dataset = minari.load_dataset("{name}")
env = dataset.recover_environment()""",
    "lerobot": """from lerobot.datasets.lerobot_dataset import LeRobotDataset

dataset = LeRobotDataset("{name}", root=".")""",
}
HUB = {
    "parquet": ("labgym", 'configs:\n- config_name: steps\n  data_files: "steps/*.parquet"\n- config_name: episodes\n'
                "  data_files: episodes.parquet\n"),
    "minari": ("minari", ""),
    "lerobot": ("LeRobot", 'configs:\n- config_name: default\n  data_files: "data/*/*.parquet"\n'),
}  # fmt: skip
"""Tag and configuration of the card's header, by format."""


def command(options: DriveOptions) -> str:
    """Return the command that makes the dataset again."""
    level = "" if options.task == POINT else f" --level {options.level}"
    good = " --successful" if options.successful else ""
    return (
        f"labgym data --format {options.format} --task {options.task}{level} --split {options.split} "
        f"--policy {options.policy} --sensors {options.sensors} --episodes {options.episodes} --seed {options.seed} "
        f"--shard {options.shard}{good}"
    )


def card(options: DriveOptions, attempts: Sequence[Attempt], versions: Mapping[str, str]) -> str:
    """Return the card as Markdown.

    Args:
        options: of the dataset. attempts: all drives of the expert, also dropped ones, in their order.
        versions: of labgym and of the packages that decide the bytes.
    """
    kept = [each for each in attempts if each.kept]
    tag, header = HUB[options.format]
    summary = "drive to a point and rest there" if options.labnav is None else options.labnav.summary
    training = "training" if options.split in TRAINING_SPLITS else "validation: for development, not for training"
    endings = ", ".join(
        f"{ending} {count}" for ending, count in Counter(each.ending for each in attempts).most_common()
    )
    arguments = ", ".join(
        f"{name}={json.dumps(value) if isinstance(value, str) else value}"
        for name, value in options.spec.kwargs.items()
    )
    return f"""---
license: apache-2.0
task_categories: [robotics]
tags: [{tag}, robot-navigation, laboratory]
{header}---
# {options.name}

Drives of the expert `{options.policy}` in `{options.spec.id}` of labgym: {summary} (`{options.task_id}`).

| | |
|---|---|
| episodes | {len(kept)} |
| steps of 0.1 s | {sum(each.steps for each in kept)} |
| observations | {options.sensors} |
| split | {options.split} ({training}) |
| success rate of the expert | {mean([each.success for each in attempts]):.3f} of {len(attempts)} drives |
| mean score of the expert | {mean([each.score for each in attempts]):.3f} |
| mean score of the episodes | {mean([each.score for each in kept]):.3f} |
| endings of all drives | {endings} |

Every episode takes place on a layout that its seed draws. {_dropped(options, attempts)}

## Made by

    {command(options)}

with {", ".join(f"{name} {version}" for name, version in versions.items())}.
The bytes depend on these options and versions, not on the number of processes.

## Reading

```python
{READING[options.format].format(name=options.name)}
```

`docs/training-data.md` of labgym describes every column.

The actions of an episode, carried out again after `env.reset(seed=seed)` with its seed, give the same observations and
rewards, bit for bit, in

```python
import gymnasium as gym
import labgym

env = gym.make("{options.spec.id}", {arguments})
```

## Limits

{_limits(options)}
- The score is by the rules of LabNav's evaluation as they apply in this environment, which differs from the evaluation
  in how a drive of `shift` that failed ends; of the task `point` it is SPL. The steps of STOP count in neither.
- Simulated: docs/labnav.md lists the assumptions.

License: Apache-2.0, as labgym.
"""


def _dropped(options: DriveOptions, attempts: Sequence[Attempt]) -> str:
    """Return what became of failed drives."""
    if not options.successful:
        return "Failed drives are kept: select by `success` or `ending`."
    dropped = sum(not each.kept for each in attempts)
    return f"Failed drives were dropped ({dropped}) and drawn again, so easy drives are more frequent than in the task."


def _limits(options: DriveOptions) -> str:
    """Return limits that depend on the options."""
    entry = BUILT_IN[options.policy]
    limits = []
    if entry.sees in SEES:
        limits.append(
            f"The expert received {SEES[entry.sees]}; the observations do not hold that, so not all actions follow."
        )
    elif entry.sees in ("lidar", "depth", "rgbd") and entry.sees != options.sensors:
        limits.append(f"The expert drove by {entry.sees}, which the observations do not hold.")
    limits.append(
        "Columns that begin with `privileged.` are what no policy may see; do not train policies on them as inputs."
    )
    if options.format == "lerobot" and options.sensors != "lidar":
        limits.append("Videos are compressed. That of depth has 8 bits; the feature `depth` has the exact meters.")
    return "\n".join(f"- {each}" for each in limits)
