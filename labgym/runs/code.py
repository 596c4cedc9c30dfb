"""The digest of the installed code: sources, templates and the artefacts that decide results."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

import labgym
from labgym.artefacts import artefacts

SOURCES = (".py", ".j2")


@cache
def code_digest() -> str:
    """Return the SHA-256 of the package's sources and templates and of the JSON files of the assets.

    Paths are hashed relative to the package and to the artefact folder, so that a checkout and a wheel of the same
    version have the same digest. Published layouts, suites and weights are not included: a run names those that it
    uses by their own hashes.
    """
    package = Path(labgym.__file__).resolve().parent
    assets = artefacts("assets")
    sources = [path for path in package.rglob("*") if path.suffix in SOURCES]
    files = {path.relative_to(package).as_posix(): path for path in sources if "_artefacts" not in path.parts}
    files |= {f"assets/{path.relative_to(assets).as_posix()}": path for path in assets.rglob("*.json")}
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{hashlib.sha256(files[name].read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()
