"""Command groups with a default command."""

from __future__ import annotations

from collections.abc import Sequence

from tyro.extras import SubcommandApp


class CommandGroup(SubcommandApp):
    """A group with a default command: `labgym protocols sub_01` is short for `labgym protocols show sub_01`.

    Args:
        default: name of the command that runs if the first argument is not the name of a command.
    """

    def __init__(self, default: str) -> None:
        super().__init__()
        self.default = default

    def named(self, arguments: Sequence[str]) -> list[str]:
        """Return the group's arguments, with the name of the default command inserted if no command is named."""
        words = list(arguments)
        asks_help = words[:1] in (["-h"], ["--help"])
        return words if asks_help or (words and words[0] in self._subcommands) else [self.default, *words]
