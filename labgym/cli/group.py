"""Command groups with a default command, and what is said about commands that do not exist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from types import MappingProxyType

from tyro.extras import SubcommandApp

from labgym.errors import OptionError

SIMILAR = 0.6
"""Least similarity of a misspelled command to the one that is named for it."""


class CommandGroup(SubcommandApp):
    """A group with a default command: `labgym protocols sub_01` is short for `labgym protocols show sub_01`.

    Args:
        default: name of the command that runs if the first argument is not the name of a command.
        arguments: number of arguments without a name that the default command takes.
        alike: commands of the group by other words for what they do: "validate" for check.
    """

    def __init__(self, default: str, arguments: int = 1, alike: Mapping[str, str] = MappingProxyType({})) -> None:
        super().__init__()
        self.default, self.arguments, self.alike = default, arguments, alike

    def named(self, arguments: Sequence[str]) -> list[str]:
        """Return the group's arguments, with the name of the default command inserted if no command is named.

        Raises:
            OptionError: the first argument can only be a command, and is not one of the group.
        """
        words = list(arguments)
        asks_help = words[:1] in (["-h"], ["--help"])
        if asks_help or (words and words[0] in self._subcommands):
            return words
        plain = 0
        while plain < len(words) and not words[plain].startswith("-"):
            plain += 1
        if plain > self.arguments or (words and words[0] in self.alike):
            raise OptionError(_unknown(words[0], list(self._subcommands), self.alike))
        return [self.default, *words]


def refuse_unknown_command(app: SubcommandApp, words: Sequence[str]) -> None:
    """Raise an error if words name a command, or a command of a group, that does not exist.

    Raises:
        OptionError: names the command, the nearest one and all.
    """
    group = app
    for word in words:
        if word.startswith("-"):
            return
        command = group._subcommands.get(word)
        if command is None:
            raise OptionError(_unknown(word, list(group._subcommands), {}))
        if not isinstance(command.target, SubcommandApp):
            return
        group = command.target


def _unknown(word: str, commands: Sequence[str], alike: Mapping[str, str]) -> str:
    nearest = [alike[word]] if word in alike else get_close_matches(word, commands, 1, SIMILAR)
    hint = f" (nearest: {nearest[0]})" if nearest else ""
    return f"there is no command {word[:60]!r}{hint}; the commands are {', '.join(commands)}"
