"""Clutter: trolleys, cartons, stools pulled out, drums and signs that make a laboratory look used."""

from labgym.layouts.clutter.kinds import LEVELS
from labgym.layouts.clutter.scatter import add_clutter, check_level

__all__ = ["LEVELS", "add_clutter", "check_level"]
