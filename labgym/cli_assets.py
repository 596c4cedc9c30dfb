"""The commands about assets: listing, showing, checking, and their USD files."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from labgym.cli_group import CommandGroup
from labgym.cli_outcome import DONE, findings, written

assets_app = CommandGroup("show")


@assets_app.command
def show(
    name: Positional[str | None] = None,
    kind: Literal["reagent", "instrument", "facility"] | None = None,
    check: bool = False,
) -> int:
    """List the catalogue, describe one asset, or check that the catalogue is plausible.

    Args:
        name: Name or synonym of an asset, in English or Chinese; nothing lists all.
        kind: List the assets of this kind alone.
        check: Check sizes, hazards and chemistry of every asset; exit 1 where something is wrong.
    """
    from labgym.assets import Catalog
    from labgym.describe import asset_details, asset_table

    catalog = Catalog.load()
    if check:
        from labgym.assets.checks import check as check_catalog

        return findings([f"{p.asset}: {p.field}: {p.message}" for p in check_catalog(catalog)])
    print(asset_details(catalog.find(name)) if name else asset_table(catalog.of_kind(kind) if kind else catalog))
    return DONE


@assets_app.command
def build(names: Positional[tuple[str, ...]] = (), out: Path | None = None, check: bool = False) -> int:
    """Write assets as USD files with materials, colliders, mass and hazards; needs the extra usd.

    Args:
        names: Names or synonyms of assets; nothing takes the whole catalogue.
        out: Folder for KIND/NAME.usda; by default assets/usd of this checkout or installation.
        check: Write nothing; exit 1 where a file is missing, not current, or not clean under OpenUSD's validators.
    """
    from tqdm import tqdm

    from labgym.assets import Catalog
    from labgym.assets.usd import check_files, stray_files, usd_folder, write_files

    catalog = Catalog.load()
    assets = [catalog.find(name) for name in names] or list(catalog)
    folder = out or usd_folder()
    if check:
        checked = tqdm(check_files(assets, folder), total=len(assets), desc="checked", unit="asset")
        problems = [line for _, lines in checked for line in lines]
        strays = () if names else stray_files(assets, folder)
        return findings([*problems, *(f"{path} belongs to no asset" for path in strays)])
    for _ in tqdm(write_files(assets, folder), total=len(assets), desc="written", unit="asset"):
        pass
    return written(folder)
