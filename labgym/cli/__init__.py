"""The `labgym` command: thin, each group of commands in a module of its own."""

from labgym.cli.app import main

__all__ = ["main"]
