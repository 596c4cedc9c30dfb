"""The `labgym` command: a thin layer with one module per group of commands."""

from labgym.cli.app import main

__all__ = ["main"]
