"""All commands as one table; only the module of the named command is imported."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module

import tyro
from tyro.conf import FlagCreatePairsOff
from tyro.extras import SubcommandApp

from labgym.errors import OptionError

CONFIG = (FlagCreatePairsOff,)
SIMILAR = 0.6
"""Least similarity of a misspelled command to the one that is named for it."""


@dataclass(frozen=True)
class CommandGroup:
    """Commands with a common first word.

    Attributes:
        help: description of the group.
        commands: functions of the commands by name, as MODULE:FUNCTION in `labgym.cli`.
        default: command that runs if the first argument is not the name of a command: `labgym protocols sub_01` is
            short for `labgym protocols show sub_01`.
        arguments: number of arguments without a name that the default command takes.
        alike: commands of the group by other words for what they do: "validate" for check.
    """

    help: str
    commands: Mapping[str, str]
    default: str | None = None
    arguments: int = 1
    alike: Mapping[str, str] = field(default_factory=dict)

    def named(self, arguments: Sequence[str]) -> list[str]:
        """Return the group's arguments, with the name of the default command inserted if no command is named.

        Raises:
            OptionError: the first argument can only be a command, and is not one of the group.
        """
        words = list(arguments)
        asks_help = words[:1] in (["-h"], ["--help"])
        if self.default is None or asks_help or (words and words[0] in self.commands):
            return words
        plain = 0
        while plain < len(words) and not words[plain].startswith("-"):
            plain += 1
        if plain > self.arguments or (words and words[0] in self.alike):
            raise OptionError(_unknown(words[0], self.commands, self.alike))
        return [self.default, *words]


COMMANDS: Mapping[str, str | CommandGroup] = {
    "run": "app:run",
    "assets": CommandGroup(
        "List, show, find and check assets; add meshes; write USD files. Plain `labgym assets` lists all; "
        "`labgym assets rotovap` shows one (short for `show rotovap`).",
        {
            "show": "assets:show",
            "add": "assets:add",
            "add-reagent": "assets:add_reagent",
            "build": "assets:build",
            "compat": "assets:compat",
            "infer": "assets:infer",
            "find": "assets:find",
        },
        default="show",
        alike={"search": "find", "list": "show"},
    ),
    "protocols": CommandGroup(
        "List, show, search, write, check, import, export protocols. Plain `labgym protocols` lists those published; "
        "`labgym protocols sub_01` shows one (short for `show sub_01`).",
        {
            "show": "protocols:show",
            "search": "protocols:search",
            "new": "protocols:new",
            "check": "protocols:check",
            "export": "protocols:export",
            "survey": "protocols:survey",
            "experiments": "protocols:experiments",
            "stage": "protocols:stage",
            "import": "protocols:import_",
            "filter": "protocols:filter_",
            "score-reading": "protocols:score_reading",
        },
        default="show",
        alike={"validate": "check", "verify": "check", "create": "new", "write": "new", "list": "show"},
    ),
    "generate": "layouts:generate",
    "trace": "traces:trace",
    "score": "scores:score",
    "compile": "engineering:compile_",
    "view": "engineering:view",
    "play": "viewing:play",
    "move": "engineering:move",
    "repair": "repairs:repair",
    "outline": "outlines:outline",
    "import": CommandGroup("Read laboratories that other programs wrote.", {"labbuilder": "imports:labbuilder"}),
    "eval": "evaluation:eval_",
    "leaderboard": "leaderboard:leaderboard",
    "record": "recording:record",
    "serve": "app:serve",
    "reproduce": CommandGroup(
        "Reproduce what was published. Plain `labgym reproduce --split test` checks the published layouts (short for "
        "`published --split test`); the other commands reproduce the tables of the paper.",
        {
            "published": "reproduction:published",
            "protocols": "reproduction:protocols",
            "labbuilder": "reproduction:labbuilder",
            "comparison": "reproduction:comparison",
            "ablation": "reproduction:ablation",
            "navigation": "reproduction:navigation",
            "repair": "reproduction:repair",
            "nuisances": "reproduction:nuisances",
            "all": "reproduction:all_",
        },
        default="published",
        arguments=0,
    ),
    "policies": "app:policies",
    "floors": "splits:floors",
    "labnav": "splits:labnav",
    "describe": CommandGroup("Describe splits of floors.", {"splits": "splits:splits"}),
    "submit": CommandGroup(
        "Write the folder and text of a submission; check results that others submit.",
        {"pack": "submission:pack", "check": "submission:check"},
        alike={"write": "pack", "prepare": "pack", "new": "pack", "verify": "check"},
    ),
    "data": "training_data:data",
    "train": CommandGroup(
        "Train a policy, or resume an interrupted training run.",
        {
            "ppo": "reinforcement:ppo",
            "recurrent-ppo": "reinforcement:recurrent_ppo",
            "sac": "reinforcement:sac",
            "her": "reinforcement:her",
            "floors": "reinforcement:floors",
            "local-practice": "local_planner:local_practice",
            "local-imitation": "local_planner:local_imitation",
            "local-ppo": "local_planner:local_ppo",
            "iplanner": "training:iplanner",
            "navdp": "training:navdp",
            "ppo-imitation": "training:train_ppo",
        },
    ),
    "ablate": CommandGroup(
        "Run an ablation study of a policy: change one part at a time.",
        {
            "local-imitation": "local_planner:ablate_local_imitation",
            "local-ppo": "local_planner:ablate_local_ppo",
            "iplanner": "training:ablate_iplanner",
            "navdp": "training:ablate_navdp",
        },
    ),
    "card": CommandGroup(
        "Publish a trained policy with its model card.",
        {
            "local-imitation": "local_planner:card_local_imitation",
            "local-ppo": "local_planner:card_local_ppo",
            "iplanner": "training:card_iplanner",
            "navdp": "training:card_navdp",
            "ppo": "training:card_ppo",
        },
    ),
    "report": "evaluation:report",
    "compare": "evaluation:compare",
    "bench": "app:bench",
    "coverage": "evaluation:coverage",
    "doctor": "app:doctor",
}
"""Functions of the commands, as MODULE:FUNCTION in `labgym.cli`, and groups of commands, by name."""


ALIKE: Mapping[str, str] = {
    "evaluate": "eval", "evaluation": "eval", "test": "eval", "benchmark": "eval", "drive": "eval",
    "film": "record", "video": "record", "gif": "record", "replay": "record",
    "show": "view", "draw": "view", "plot": "view", "render": "view", "watch": "view", "web": "view",
    "teleop": "play", "keyboard": "play",
    "check": "score", "validate": "score", "metrics": "score", "violations": "score", "safety": "score",
    "create": "generate", "new": "generate", "layout": "generate", "layouts": "generate", "laboratory": "generate",
    "export": "compile", "convert": "compile", "usd": "compile", "dxf": "compile", "ros": "compile",
    "fix": "repair", "asset": "assets", "catalog": "assets", "reagents": "assets",
    "protocol": "protocols", "experiments": "protocols", "procedure": "protocols",
    "results": "report", "site": "report", "html": "report", "diff": "compare",
    "ranking": "leaderboard", "publish": "leaderboard", "submission": "submit",
    "dataset": "data", "learn": "train", "ppo": "train", "baselines": "policies", "models": "policies",
    "server": "serve", "install": "doctor", "info": "doctor", "start": "run", "pipeline": "run",
    "simulate": "eval", "rollout": "eval", "demo": "view", "quickstart": "run", "website": "leaderboard",
    "tasks": "labnav", "episodes": "labnav", "agents": "policies", "list": "policies",
    "speed": "bench", "suites": "labnav", "splits": "describe",
}  # fmt: skip
"""Commands by other words for what they do."""


def command_function(reference: str) -> Callable[..., int]:
    """Import and return the function of a command, which is named as MODULE:FUNCTION in `labgym.cli`."""
    module, function = reference.split(":")
    return getattr(import_module(f"labgym.cli.{module}"), function)  # type: ignore[no-any-return]


def run_command(words: Sequence[str]) -> int:
    """Parse the words of a command line, run the command that they name, and return its exit code.

    Only the module of that command is imported; for the help of a group, those of its commands.
    """
    entry, program, rest = COMMANDS[words[0]], f"labgym {words[0]}", list(words[1:])
    if isinstance(entry, CommandGroup) and (not rest or rest[0] not in entry.commands):
        app = SubcommandApp()
        for name, reference in entry.commands.items():
            app.command(name=name)(command_function(reference))
        return int(app.cli(prog=program, description=entry.help, args=rest, config=CONFIG))
    if isinstance(entry, CommandGroup):
        entry, program, rest = entry.commands[rest[0]], f"{program} {rest[0]}", rest[1:]
    return int(tyro.cli(command_function(entry), prog=program, args=rest, config=CONFIG))


def refuse_unknown_command(words: Sequence[str]) -> None:
    """Raise an error if words name a command, or a command of a group, that does not exist.

    Raises:
        OptionError: names the command, the nearest one and all.
    """
    commands: Mapping[str, str | CommandGroup] = COMMANDS
    alike = ALIKE
    for place, word in enumerate(words):
        if place and word.startswith("-"):
            return
        if word not in commands:
            raise OptionError(_unknown(word, commands, alike))
        entry = commands[word]
        if not isinstance(entry, CommandGroup):
            return
        commands, alike = entry.commands, entry.alike


def _unknown(word: str, commands: Mapping[str, object], alike: Mapping[str, str]) -> str:
    first = word.split("-")[0]
    nearest = alike.get(word) or (first if first in commands else alike.get(first))
    nearest = nearest or next(iter(get_close_matches(word, commands, 1, SIMILAR)), None)
    hint = f" (nearest: {nearest})" if nearest else ""
    return f"there is no command {word[:60]!r}{hint}; the commands are {', '.join(commands)}"
