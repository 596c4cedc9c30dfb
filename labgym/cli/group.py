"""Commands that share a name, one of which is meant where none is named."""

from __future__ import annotations

from collections.abc import Sequence

from tyro.extras import SubcommandApp


class CommandGroup(SubcommandApp):
    """A group whose default command also takes positional arguments: `labgym protocols sub_01` shows it.

    Args:
        default: name of the command that is meant where the first argument is no command's name.
    """

    def __init__(self, default: str) -> None:
        super().__init__()
        self.default = default

    def named(self, arguments: Sequence[str]) -> list[str]:
        """Return the group's arguments with the default command's name put in front where none is named."""
        given = list(arguments)
        help_wanted = given[:1] in (["-h"], ["--help"])
        return given if help_wanted or (given and given[0] in self._subcommands) else [self.default, *given]
