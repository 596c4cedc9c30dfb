"""Repair of any layout, with a list of what was changed and what is still wrong."""

from labgym.layouts.repairs.changes import changes
from labgym.layouts.repairs.procedure import Repair, repair_layout

__all__ = ["Repair", "changes", "repair_layout"]
