"""Where the artefact folders (assets, layouts, policies, eval) are, in a checkout and in a wheel."""

from __future__ import annotations

from pathlib import Path

from labgym.errors import UnknownNameError

FOLDERS = ("assets", "layouts", "policies", "eval")


def artefacts(folder: str) -> Path:
    """Return the artefact folder of that name.

    A wheel carries the folders inside the package; a checkout has them beside it.

    Raises:
        UnknownNameError: there is no such folder.
    """
    package = Path(__file__).resolve().parent
    for root in (package / "_artefacts", package.parent):
        if folder in FOLDERS and (root / folder).is_dir():
            return root / folder
    raise UnknownNameError("artefact folder", folder, FOLDERS)
