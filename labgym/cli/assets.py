"""The commands about assets: list, show, check, find, compare, classify, add, and write USD files."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from labgym.assets.catalog import FOLDER_VARIABLE, Catalog
from labgym.assets.model import Kind
from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath, OptionalText, Texts
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import DONE, complaints, findings, written
from labgym.cli.saving import Overwrite
from labgym.errors import LabgymError, OptionError

if TYPE_CHECKING:
    from labgym.assets import Asset
    from labgym.assets.forge import Annotator, Described, OwnAssets

Axis = Literal["X", "Y", "Z"]
Direction = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
State = Literal["solid", "liquid", "gas"]


@refuses_idle_flags("assets show")
def show(
    name: Positional[Annotated[str | None, arg(metavar="[NAME]", help_behavior_hint="")]] = None,
    kind: Annotated[Kind | None, arg(metavar="KIND", help_behavior_hint="")] = None,
    check: bool = False,
) -> int:
    """List the catalog, describe one asset, or check the catalog. `labgym assets NAME` works without `show`.

    Args:
        name: Name or synonym of an asset, in English or Chinese; without it all are listed.
        kind: List only the assets of this kind: reagent, instrument or facility.
        check: Check sizes, hazards and chemistry of every asset; exit code 1 if a check fails.
    """
    from labgym.cli.describe import asset_details, asset_table

    catalog = Catalog.load()
    if check:
        from labgym.assets import checks

        problems = checks.check(catalog)
        return findings([f"{problem.asset}: {problem.field}: {problem.message}" for problem in problems])
    print(asset_details(catalog.find(name)) if name else asset_table(catalog.of_kind(kind) if kind else catalog))
    return DONE


@refuses_idle_flags("assets add")
def add(
    paths: Positional[Annotated[tuple[Path, ...], arg(metavar="PATH [PATH ...]", help_behavior_hint="(required)")]],
    *,
    catalog: OptionalPath = None,
    unit: OptionalText = None,
    scale: Annotated[float | None, arg(metavar="FACTOR", help_behavior_hint="")] = None,
    up: Annotated[Axis | None, arg(metavar="X|Y|Z", help_behavior_hint="")] = None,
    front: Annotated[Direction | None, arg(metavar="+x|-x|+y|-y|+z|-z", help_behavior_hint="")] = None,
    name: OptionalText = None,
    like: OptionalText = None,
    overwrite: Overwrite = False,
    model: bool = False,
    execution: Execution = THIS_PROCESS,
) -> int:
    """Add USD, GLB, OBJ or STL files to your own catalog folder, annotated by rules; exit code 1 if some fail.

    A file that fails does not stop the others, and after an interruption finished files are not annotated again. The
    published catalog does not change. If LABGYM_CATALOG names the folder, every command uses it in addition.

    Args:
        paths: Mesh files, or folders whose mesh files are added.
        catalog: Folder of your own assets; by default the one that LABGYM_CATALOG names, else labgym-assets.
        unit: Unit of the files, such as mm or in; by default the file's, else mm for STL, cm for USD, m otherwise.
        scale: Factor applied after the unit, for models that are drawn without a unit.
        up: Vertical axis of the files; by default the file's, else Z for STL and Y otherwise.
        front: Direction of the front, in the files' own axes; by default +z with Y up and +y with Z up.
        name: Canonical name in CamelCase, for a single file.
        like: Published asset, by name or synonym, that the file is a model of.
        overwrite: Replace an asset of the same name.
        model: Describe each asset with the configured language model, using rendered images.
    """
    from tqdm import tqdm

    from labgym.assets.forge import Options, OwnAssets, mesh_files

    own = OwnAssets(catalog)
    files = list(mesh_files(paths, own.folder))
    if not files or (name is not None and len(files) > 1):
        raise OptionError("name a file or a folder to add" if not files else f"--name {name!r} is for a single file")
    annotator, label = _model_annotator() if model else (None, "")
    options = Options(unit, up, front, name, like, label, scale)
    problems: list[str] = []
    additions = own.add_files(files, options, overwrite, annotator, _pictures, execution.options())
    for addition in tqdm(additions, "added", len(files), unit="file", disable=True if len(files) == 1 else None):
        if addition.problem:
            problems.append(addition.problem)
            continue
        tqdm.write(f"{addition.outcome} {addition.name}")
        for note in addition.notes:
            tqdm.write(f"labgym: {addition.name}: {note}", file=sys.stderr)
    if len(files) == 1 and problems:
        raise LabgymError(problems[0])
    if len(files) > 1:
        print(f"{len(files) - len(problems)} of {len(files)} files are in the catalog")
    _activation_hint(own)
    return complaints(problems)


def add_reagent(
    name: Positional[Annotated[str, arg(metavar="NAME")]],
    smiles: Annotated[str, arg(metavar="SMILES")],
    synonyms: Texts = (),
    state: Annotated[State | None, arg(metavar="solid|liquid|gas", help_behavior_hint="")] = None,
    density: Annotated[float | None, arg(metavar="G/ML", help_behavior_hint="")] = None,
    catalog: OptionalPath = None,
    overwrite: Overwrite = False,
) -> int:
    """Add a reagent to your own catalog folder from its structure; needs the extra chem.

    Reactive groups, hazard flags and storage class are inferred by rules and marked as inferred; the pack is a 500 mL
    bottle, a 500 g jar or a gas cylinder. Read the safety data sheet. Every command uses the folder if LABGYM_CATALOG
    names it.

    Args:
        name: Name of the substance, such as "2-methylanisole"; its canonical name is made from it.
        smiles: The structure as SMILES, quoted.
        synonyms: Other names.
        state: State at room temperature; by default proposed from the structure.
        density: Density in g/mL.
        catalog: Folder of your own assets; by default the one that LABGYM_CATALOG names, else labgym-assets.
        overwrite: Replace a reagent of the same name.
    """
    from labgym.assets.forge import OwnAssets
    from labgym.assets.inference import infer
    from labgym.cli.describe import asset_details

    own = OwnAssets(catalog)
    reagent = infer(smiles, name, synonyms, state, density)
    outcome = own.add_reagent(reagent, overwrite)
    print(f"{outcome} {reagent.name}\n\n{asset_details(reagent)}")
    _activation_hint(own)
    return DONE


def build(
    names: Positional[Annotated[tuple[str, ...], arg(metavar="[NAME ...]", help_behavior_hint="")]] = (),
    out: OptionalPath = None,
    check: bool = False,
) -> int:
    """Write assets as USD files with materials, colliders, mass and hazards; needs the extra usd.

    Args:
        names: Names or synonyms of assets; by default the whole published catalog.
        out: Folder for KIND/NAME.usdc; by default assets/usd of this checkout or installation.
        check: Write nothing; exit code 1 if a file is missing, outdated, or fails OpenUSD's validators.
    """
    from tqdm import tqdm

    from labgym.assets.usd import check_files, stray_files, usd_folder, write_files

    catalog = Catalog.load()
    assets = [catalog.find(name) for name in names] or list(Catalog.published())
    own = [asset.name for asset in assets if asset.name not in Catalog.published()]
    if own and out is None:
        raise OptionError(f"{own[0]!r} is one of your own assets; name a folder for its USD file with --out")
    folder = out or usd_folder()
    if check:
        results = tqdm(check_files(assets, folder), total=len(assets), desc="checked", unit="asset", disable=None)
        problems = [line for _, lines in results for line in lines]
        strays = () if names else stray_files(assets, folder)
        return findings([*problems, *(f"{path} belongs to no asset" for path in strays)])
    for _ in tqdm(write_files(assets, folder), total=len(assets), desc="written", unit="asset", disable=None):
        pass
    return written(folder)


def compat(
    first: Positional[Annotated[str, arg(metavar="REAGENT")]],
    second: Positional[Annotated[str | None, arg(metavar="[REAGENT]", help_behavior_hint="")]] = None,
) -> int:
    """Print what happens when two reagents mix, why, the sources, and whether layouts separate them.

    Args:
        first: A reagent, by name, synonym or CAS number, in English or Chinese, or a SMILES (extra chem).
        second: The other reagent, which may be the same; if omitted, list all that must not be mixed with the first.
    """
    from labgym.assets.reagents import distinct, reactive_reagent
    from labgym.cli.describe import compatibility_details, compatibility_table

    catalog = Catalog.load()
    reagents = distinct([reactive_reagent(catalog, name) for name in (first, second) if name is not None])
    print(compatibility_details(*reagents) if second is not None else compatibility_table(reagents[0], catalog))
    return DONE


def infer(
    smiles: Positional[Annotated[str | None, arg(metavar="[SMILES]", help_behavior_hint="")]] = None,
    agreement: bool = False,
) -> int:
    """Classify a substance by its structure: reactive groups, hazards, storage; needs the extra chem.

    Args:
        smiles: The structure as SMILES, quoted.
        agreement: Compare the classification of the catalog's reagents with their data instead.
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


def find(text: Positional[Annotated[str, arg(metavar="TEXT")]], count: int = 0) -> int:
    """Find the asset that a text names and print how it was matched; exit code 2 without a match.

    Exact names come first, then synonyms and CAS numbers, in English and Chinese, then misspellings; for reagents only
    those that cannot be another substance. Sizes, concentrations, grades and makers may accompany the name.

    Args:
        text: Free text: "rbf 250 ml", "旋蒸", "conc. HCl", 67-64-1.
        count: List this many assets that are spelled most like the text instead.
    """
    from labgym.cli.describe import match_details, match_table

    if not 0 <= count <= 50:
        raise OptionError(f"count is {count}, expected 0 to 50")
    catalog = Catalog.load()
    if count and (near := catalog.candidates(text, count)):
        print(match_table(near))
        return DONE
    match = catalog.require(text)
    print(match_details(match, catalog.get(match.name)))
    return DONE


def _activation_hint(own: OwnAssets) -> None:
    """Print how to use a folder unless LABGYM_CATALOG names it already."""
    if not own.is_active:
        print(f"labgym: to use them: export {FOLDER_VARIABLE}={own.folder.resolve()}", file=sys.stderr)


def _model_annotator() -> tuple[Annotator, str]:
    """Return the configured language model as an annotator, and its name."""
    from labgym.assets.forge.modelled import describe
    from labgym.llm import LanguageModel

    client = LanguageModel.from_environment()

    def annotator(measured: Mapping[str, Any], draft: Mapping[str, Any], pictures: Sequence[bytes]) -> Described:
        return describe(client, Catalog.published(), measured, draft, pictures)

    return annotator, client.config.model


def _pictures(asset: Asset) -> Sequence[bytes]:
    """Return PNG pictures of an asset for a language model."""
    import cv2

    from labgym.scenes import asset_sheet

    ok, png = cv2.imencode(".png", asset_sheet([asset], columns=1, tile=512)[:, :, ::-1])
    return [png.tobytes()] if ok else []
