"""Where evaluations are written by default."""

from __future__ import annotations

import re
from pathlib import Path

from labgym.policies.registry import FILES, is_class_place


def default_folder(policy: str, suite: str | Path) -> Path:
    """Return where `labgym eval` writes by default: runs/POLICY-SUITE."""
    return Path("runs") / f"{folder_name(policy)}-{Path(suite).stem}"


def folder_name(policy: str) -> str:
    """Return the name of a policy as the name of a folder: `mine:GoToGoal` becomes mine_GoToGoal."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", short_name(policy) if Path(policy).suffix.lower() in FILES else policy)


def short_name(policy: str) -> str:
    """Return a policy's label as tables show it: of a class without its module, of a file without path and suffix."""
    if Path(policy).suffix.lower() in FILES:
        return Path(policy).stem
    return policy.rpartition(":")[2] if is_class_place(policy) else policy
