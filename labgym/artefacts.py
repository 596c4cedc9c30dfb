"""Paths of the artefact folders (assets, layouts, policies, eval) and of the user's cache."""

from __future__ import annotations

import os
from pathlib import Path

from labgym.errors import UnknownNameError

FOLDERS = ("assets", "layouts", "policies", "eval")


def artefacts(folder: str) -> Path:
    """Return the path of an artefact folder.

    A wheel contains the folders inside the package, a checkout next to it.

    Raises:
        UnknownNameError: the folder does not exist.
    """
    package = Path(__file__).resolve().parent
    for root in (package / "_artefacts", package.parent):
        if folder in FOLDERS and (root / folder).is_dir():
            return root / folder
    raise UnknownNameError("artefact folder", folder, FOLDERS)


def user_cache() -> Path:
    """Return the path of labgym's folder in the user's cache, which need not exist."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 -- without a home it stays
    return Path(home) / "labgym"
