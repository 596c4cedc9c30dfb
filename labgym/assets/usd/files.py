"""The catalogue's USD files on disk: made, and checked to be what would be made."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from labgym.artefacts import artefacts
from labgym.assets.model import Asset
from labgym.assets.usd.stages import asset_text
from labgym.assets.usd.validation import findings
from labgym.documents import write_text

FOLDER = "usd"


def usd_folder() -> Path:
    """Return the folder of the published USD files: a folder for each kind of asset, a file for each asset."""
    return artefacts("assets") / FOLDER


def usd_path(asset: Asset, folder: Path) -> Path:
    """Return where an asset's file is under a folder."""
    return folder / asset.kind / f"{asset.name}.usda"


def write_files(assets: Iterable[Asset], folder: Path) -> Iterator[Path]:
    """Write each asset's file, and yield its path."""
    for asset in assets:
        yield write_text(usd_path(asset, folder), asset_text(asset))


def check_files(assets: Iterable[Asset], folder: Path) -> Iterator[tuple[Asset, tuple[str, ...]]]:
    """Yield each asset with what is wrong with its file: missing, not current, or what OpenUSD's validators find.

    A file is current where reading and writing it gives what the installed USD would write for the asset now.
    """
    for asset in assets:
        yield asset, tuple(_problems(asset, usd_path(asset, folder)))


def stray_files(assets: Iterable[Asset], folder: Path) -> tuple[Path, ...]:
    """Return the USD files under a folder that belong to no asset."""
    expected = {usd_path(asset, folder) for asset in assets}
    return tuple(path for path in sorted(folder.rglob("*.usd*")) if path not in expected)


def _problems(asset: Asset, path: Path) -> Iterator[str]:
    fresh = asset_text(asset)
    from pxr import Sdf, Tf, Usd  # after the line above, which says what to install

    if not path.is_file():
        yield f"{path} is missing"
        return
    text, layer = path.read_text(encoding="utf-8"), Sdf.Layer.CreateAnonymous(".usda")
    try:
        layer.ImportFromString(text)
    except Tf.ErrorException:
        yield f"{path} cannot be read as USD"
        return
    if fresh not in (text, layer.ExportToString()):
        yield f"{path} is not what the catalogue gives now"
    yield from (f"{path}: {finding}" for finding in findings(Usd.Stage.Open(layer)))
