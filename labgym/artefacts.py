"""Paths of the artefact folders (assets, layouts, policies, eval), in a checkout and in a wheel."""

from __future__ import annotations

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
