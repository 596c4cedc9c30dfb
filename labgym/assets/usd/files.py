"""The catalog's USD files on disk: writing them, and checking that they are current and pass OpenUSD's validators."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from labgym.artefacts import artefacts
from labgym.assets.model import Asset
from labgym.assets.usd.stages import asset_layer
from labgym.documents import folder_path
from labgym.temporary import temporary_folder

FOLDER = "usd"
SUFFIX = ".usdc"
"""Binary USD: the arrays of meshes are large."""


def usd_folder() -> Path:
    """Return the folder of the published USD files: a folder for each kind of asset, a file for each asset."""
    return artefacts("assets") / FOLDER


def usd_path(asset: Asset, folder: Path) -> Path:
    """Return the path of an asset's file under a folder."""
    return folder / asset.kind / f"{asset.name}{SUFFIX}"


def write_layer(layer: Any, path: Path) -> Path:
    """Write a `pxr.Sdf.Layer` atomically, as text or binary by the path's suffix, and return the path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder(path.parent) as temporary:
        unfinished = temporary / path.name
        layer.Export(str(unfinished))
        return unfinished.replace(path)


def write_files(assets: Iterable[Asset], folder: Path) -> Iterator[Path]:
    """Write each asset's file and yield its path."""
    folder = folder_path(folder)
    for asset in assets:
        yield write_layer(asset_layer(asset), usd_path(asset, folder))


def check_files(assets: Iterable[Asset], folder: Path) -> Iterator[tuple[Asset, tuple[str, ...]]]:
    """Yield each asset with the problems of its file: missing, unreadable, outdated, or findings of the validators.

    A file is current if it has the content that the installed USD writes for the asset now.
    """
    for asset in assets:
        yield asset, tuple(_problems(asset, usd_path(asset, folder)))


def stray_files(assets: Iterable[Asset], folder: Path) -> tuple[Path, ...]:
    """Return the USD files under a folder that belong to no asset."""
    expected = {usd_path(asset, folder) for asset in assets}
    return tuple(path for path in sorted(folder.rglob("*.usd*")) if path not in expected)


def _problems(asset: Asset, path: Path) -> Iterator[str]:
    fresh = asset_layer(asset)
    from pxr import Sdf, Tf, Usd  # after the line above, whose error names the package to install

    if not path.is_file():
        yield f"{path} is missing"
        return
    try:
        layer = Sdf.Layer.OpenAsAnonymous(str(path))
    except Tf.ErrorException:
        layer = None
    if layer is None:
        yield f"{path} cannot be read as USD"
        return
    if layer.ExportToString() != fresh.ExportToString():
        yield f"{path} is outdated: run `labgym assets build`"
    yield from (f"{path}: {finding}" for finding in findings(Usd.Stage.Open(layer)))


def findings(stage: Any) -> tuple[str, ...]:
    """Return the findings of all validators of usd-core about a `pxr.Usd.Stage`, one line each, sorted."""
    errors = _context().Validate(stage)
    return tuple(sorted(" ".join(f"{error.GetName()}: {error.GetMessage()}".split()) for error in errors))


@cache
def _context() -> Any:
    from pxr import UsdValidation

    return UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
