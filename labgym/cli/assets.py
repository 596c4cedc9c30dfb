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
from labgym.errors import LabgymError, OptionError, UnknownNameError

if TYPE_CHECKING:
    from labgym.assets import Asset
    from labgym.assets.forge import Annotator

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
        from labgym.assets import checks

        problems = checks.check(catalog)
        return findings([f"{problem.asset}: {problem.field}: {problem.message}" for problem in problems])
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
        out: Folder for KIND/NAME.usdc; by default assets/usd of this checkout or installation.
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
    from labgym.assets.reagents import distinct, reactive_reagent
    from labgym.cli.describe import compatibility_details, compatibility_table

    catalog = Catalog.load()
    reagents = distinct([reactive_reagent(catalog, name) for name in (first, second) if name is not None])
    print(compatibility_details(*reagents) if second is not None else compatibility_table(reagents[0], catalog))
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
