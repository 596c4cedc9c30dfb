"""Arguments of an environment that other arguments leave without effect; passing one is an error."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import fields
from typing import TYPE_CHECKING

from labgym.effects import refuse_idle
from labgym.envs.tasks import TRAINING_SPLITS
from labgym.errors import UnknownNameError

if TYPE_CHECKING:
    from labgym.envs.config import PointNavConfig

CHOICE = ("split", "layout", "protocol", "profile", "episodes_per_layout", "training", "pool", "resident_mb", "drives")
"""Arguments that choose the task of an episode, which the argument `tasks` replaces."""
GENERATED = ("profile", "episodes_per_layout", "training", "pool")
"""Arguments of generated layouts."""
PICTURE = ("width", "height", "quality")
"""Arguments of the image from behind and above the robot."""


def check_effects(config: PointNavConfig, names: Collection[str]) -> None:
    """Refuse arguments that have no effect in a configuration.

    Args:
        names: the arguments that were passed; those that have their default are not checked.

    Raises:
        OptionError: an argument has no effect; names the reason and the remedy.
        UnknownNameError: `onward` names an ending that does not exist.
    """
    passed = [each.name for each in fields(config) if each.name in names and getattr(config, each.name) != each.default]
    for name in passed:
        reason = _reason(config, name, passed)
        refuse_idle(((f"{name}={str(getattr(config, name))[:60]!r}", bool(reason), reason),))
    if "onward" in passed:
        endings = [ending.name for ending in config.endings]
        for name in config.onward:
            if name not in endings:
                raise UnknownNameError("ending in onward", name, endings)


def _reason(config: PointNavConfig, name: str, passed: Collection[str]) -> str:
    """Return why an argument has no effect, and the remedy; "" if it has one."""
    if name in CHOICE and config.tasks is not None:
        return "with tasks, which choose layout and drive: leave one of the two out"
    if name in ("split", *GENERATED, "resident_mb") and config.layout is not None:
        return "with a fixed layout: leave one of the two out"
    if name in GENERATED and config.split not in TRAINING_SPLITS:
        return f"in split {config.split!r}, whose layouts are published: pass split='train' or split='floors-train'"
    if name == "distance_to_go" and config.rewards is not None:
        return "on these reward terms: pass rewards, such as rewards=[{'kind': 'progress', 'method': 'exact'}, ...]"
    if name == "observation" and "sensors" in passed:
        return "with sensors: pass one of the two"
    # Gymnasium's checker makes every render mode with the same arguments.
    if name in PICTURE and config.render_mode is None:
        return "without a render mode: pass render_mode='rgb_array'"
    if name == "onward" and config.tasks is None and config.drives == "pair":
        return "in episodes of one drive: pass drives='protocol'"
    return ""
