"""The commands about assets: listing, showing, checking, adding meshes, and their USD files."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tyro.conf import Positional

from labgym.assets.catalog import FOLDER_VARIABLE, Catalog
from labgym.cli.group import CommandGroup
from labgym.cli.outcome import DONE, complaints, findings, written
from labgym.errors import LabgymError, MissingDependencyError, OptionError, UnknownNameError

if TYPE_CHECKING:
    from labgym.assets import Asset
    from labgym.assets.forge import Annotator

SMILES_SIGNS = frozenset("=#()[]@")
"""What stands in structures and hardly in names."""

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
    from labgym.cli.describe import asset_details, asset_table

    catalog = Catalog.load()
    if check:
        from labgym.assets.checks import check as check_catalog

        return findings([f"{p.asset}: {p.field}: {p.message}" for p in check_catalog(catalog)])
    print(asset_details(catalog.find(name)) if name else asset_table(catalog.of_kind(kind) if kind else catalog))
    return DONE


@assets_app.command
def add(
    paths: Positional[tuple[Path, ...]],
    catalog: Path | None = None,
    unit: str | None = None,
    up: Literal["X", "Y", "Z"] | None = None,
    front: Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None = None,
    name: str | None = None,
    like: str | None = None,
    replace: bool = False,
    model: bool = False,
) -> int:
    """Add USD, GLB, OBJ or STL files to a catalogue of your own, annotated by rules; exit 1 where some fail.

    The published catalogue stays as it is; the variable LABGYM_CATALOG names the folder that is used beside it.

    Args:
        paths: Files, or folders whose mesh files are added.
        catalog: Folder of your own assets; by default what LABGYM_CATALOG names, else labgym-assets.
        unit: Unit of the files, such as mm or in; by default what they say, else the custom of their format.
        up: Axis that points up in the files; by default what they or their format say.
        front: Where the front looks, in the files' own axes.
        name: Canonical name in CamelCase, for a single file.
        like: Published asset, by name or synonym, that it is a model of.
        replace: Replace what was added under the same name.
        model: Have the language model that the environment names describe each, with pictures.
    """
    from tqdm import tqdm

    from labgym.assets.forge import Options, OwnAssets, mesh_files

    own = OwnAssets(catalog)
    files = list(mesh_files(paths, own.folder))
    if not files or (name is not None and len(files) > 1):
        raise OptionError("name a file or a folder to add" if not files else f"name {name!r} is for one file alone")
    annotator, label = _model_annotator() if model else (None, "")
    options = Options(unit, up, front, name, like, label)
    failed: list[str] = []
    for path in tqdm(files, "added", unit="file", disable=len(files) == 1):
        try:
            added, outcome = own.add(path, options, replace, annotator, _pictures)
        except LabgymError as error:
            if len(files) == 1:
                raise
            failed.append(str(error))
            continue
        tqdm.write(f"{outcome} {added}")
        for note in own.annotation(added).notes if outcome != "unchanged" else ():
            tqdm.write(f"labgym: {added}: {note}", file=sys.stderr)
    if len(files) > 1:
        print(f"{len(files) - len(failed)} of {len(files)} files are in the catalogue")
    if os.environ.get(FOLDER_VARIABLE) != str(own.folder):
        print(f"labgym: to use them: export {FOLDER_VARIABLE}={own.folder.resolve()}", file=sys.stderr)
    return complaints(failed)


@assets_app.command
def build(names: Positional[tuple[str, ...]] = (), out: Path | None = None, check: bool = False) -> int:
    """Write assets as USD files with materials, colliders, mass and hazards; needs the extra usd.

    Args:
        names: Names or synonyms of assets; nothing takes the whole published catalogue.
        out: Folder for KIND/NAME.usda; by default assets/usd of this checkout or installation.
        check: Write nothing; exit 1 where a file is missing, not current, or not clean under OpenUSD's validators.
    """
    from tqdm import tqdm

    from labgym.assets.usd import check_files, stray_files, usd_folder, write_files

    catalog = Catalog.load()
    assets = [catalog.find(name) for name in names] or list(Catalog.published())
    own = [asset.name for asset in assets if asset.name not in Catalog.published()]
    if own and out is None:
        raise OptionError(f"{own[0]!r} is an asset of your own; name a folder for its USD file with --out")
    folder = out or usd_folder()
    if check:
        checked = tqdm(check_files(assets, folder), total=len(assets), desc="checked", unit="asset")
        problems = [line for _, lines in checked for line in lines]
        strays = () if names else stray_files(assets, folder)
        return findings([*problems, *(f"{path} belongs to no asset" for path in strays)])
    for _ in tqdm(write_files(assets, folder), total=len(assets), desc="written", unit="asset"):
        pass
    return written(folder)


@assets_app.command
def compat(first: Positional[str], second: Positional[str | None] = None) -> int:
    """Say what happens when two reagents meet, why, by what source, and whether layouts keep them apart.

    Args:
        first: A reagent, by name, synonym or CAS number, in English or Chinese, or a SMILES (extra chem).
        second: The other one, which may be the same; nothing lists all that the first must not meet.
    """
    from labgym.cli.describe import compatibility_details, compatibility_table

    catalog = Catalog.load()
    given = _told_apart([_reagent(catalog, name) for name in (first, second) if name is not None])
    print(compatibility_details(*given) if second is not None else compatibility_table(given[0], catalog))
    return DONE


@assets_app.command
def infer(smiles: Positional[str | None] = None, agreement: bool = False) -> int:
    """Classify a substance by its structure: reactive groups, hazards, storage; needs the extra chem.

    Args:
        smiles: The structure as SMILES, quoted.
        agreement: Compare what the structures of the catalogue's reagents say with what it says of them.
    """
    from labgym.assets.inference import classify, compare, listed
    from labgym.cli.describe import agreement_table, inference_details

    if agreement == (smiles is not None):
        raise OptionError("give either a SMILES or --agreement")
    if smiles is not None:
        print(inference_details(classify(smiles)))
    else:
        print(agreement_table(compare(listed(Catalog.published()))))
    return DONE


@assets_app.command
def find(text: Positional[str], count: int = 0) -> int:
    """Find the asset that a text means and say how; exit 2 where nothing is near enough.

    Exact names come first, then synonyms and CAS numbers, in English and Chinese, then misspellings, of reagents only
    those that cannot be another substance. Sizes, concentrations and grades may stand beside the name.

    Args:
        text: What you would write: "rbf 250 ml", "旋蒸", "conc. HCl", 67-64-1.
        count: List this many assets that are spelt most like the text instead.
    """
    from labgym.cli.describe import match_details, match_table

    if not 0 <= count <= 50:
        raise OptionError(f"count is {count}, expected 0 to 50")
    catalog = Catalog.load()
    near = catalog.candidates(text, count or 3)
    if count and near:
        print(match_table(near))
        return DONE
    match = catalog.match(text)
    if match is None:
        raise UnknownNameError("asset", text, catalog.names, [f"{item.name} ({item.score:.2f})" for item in near])
    print(match_details(match, catalog.get(match.name)))
    return DONE


def _reagent(catalog: Catalog, name: str) -> Asset:
    """Return the reagent of that name or SMILES, of which it is known what it reacts with."""
    try:
        asset = catalog.find(name)
    except UnknownNameError:
        asset = _by_structure(catalog, name)
    if asset.kind != "reagent":
        raise OptionError(f"{asset.name} is no reagent but {asset.category} ({asset.kind}); name two reagents")
    if asset.chemistry is None or not asset.chemistry.groups:
        raise OptionError(f"no reactive groups of {asset.name} are known, so nothing can be said of it")
    return asset


def _told_apart(assets: list[Asset]) -> list[Asset]:
    """Return assets with names of their own: inferred ones have their formula's, which isomers share."""
    structures = sorted({asset.chemistry.smiles or "" for asset in assets if asset.chemistry is not None})
    if len({asset.name for asset in assets}) >= len(structures):
        return assets
    return [
        asset.model_copy(update={"name": f"{asset.name}Isomer{structures.index(asset.chemistry.smiles or '') + 1}"})
        for asset in assets
        if asset.chemistry is not None
    ]


def _by_structure(catalog: Catalog, smiles: str) -> Asset:
    """Return the reagent that a SMILES is: the catalogue's, or one with groups inferred from the structure.

    Raises:
        UnknownNameError: no SMILES, or letters alone that name nothing; lists the nearest names.
        MissingDependencyError: it looks like a SMILES and RDKit is not installed.
    """
    from labgym.assets import inference
    from labgym.assets.structures import StructureError, reagent_of

    reagents, looks_like_smiles = catalog.of_kind("reagent"), not SMILES_SIGNS.isdisjoint(smiles)
    try:
        asset = reagent_of(smiles, reagents)
        # An abbreviation that the catalogue lacks may be a SMILES by accident, as NCS is; signs tell that one is meant.
        if asset is None and looks_like_smiles:
            asset = inference.infer(smiles)
    except StructureError:
        asset = None
    except MissingDependencyError:
        if looks_like_smiles:
            raise
        asset = None
    if asset is None:
        raise UnknownNameError("reagent", smiles, (reagent.name for reagent in reagents))
    return asset


def _model_annotator() -> tuple[Annotator, str]:
    """Return the configured language model as an annotator, and its name."""
    from labgym.assets.forge import Described
    from labgym.assets.forge.llm_annotator import describe
    from labgym.llm import LanguageModel

    client = LanguageModel.from_environment()

    def annotator(measured: Mapping[str, Any], draft: Mapping[str, Any], pictures: Sequence[bytes]) -> Described:
        return Described.model_validate(describe(client, Catalog.published(), measured, draft, pictures).model_dump())

    return annotator, client.config.model


def _pictures(asset: Asset) -> Sequence[bytes]:
    """Return PNG pictures of an asset for a language model."""
    import cv2

    from labgym.scenes import asset_sheet

    ok, png = cv2.imencode(".png", asset_sheet([asset], columns=1, tile=512)[:, :, ::-1])
    return [png.tobytes()] if ok else []
