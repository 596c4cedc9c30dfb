"""What every protocol begins and ends with: weighing and staging, and cleaning up."""

from __future__ import annotations

from labgym.assets import Asset, Catalog
from labgym.protocols.synthesis.bench import Bench

GLOVE_BOX = (
    *("AluminumChloride", "Lithium", "LithiumAluminumHydride", "Potassium", "PotassiumTertButoxide", "Sodium"),
    *("SodiumEthoxide", "SodiumHydride", "SodiumMethoxide", "TertButyldimethylsilylChloride"),
)
"""Solids that are weighed where no moisture is."""
PYROPHORIC = "H250"


def weigh_first(bench: Bench, vessel: str) -> None:
    """Put the preparation before everything else: solids weighed, moisture-sensitive ones in the glove box."""
    solids = [use.name for use in bench.reagents if is_solid(Catalog.load().get(use.name))]
    dry = tuple(name for name in solids if name in GLOVE_BOX or is_pyrophoric(Catalog.load().get(name)))
    plain = tuple(name for name in solids if name not in dry)
    steps, bench.steps = bench.steps, []
    if plain:
        text = f"Weigh {', '.join(words(name) for name in plain)}; carry the closed bottles of the liquids to the hood."
        bench.do("Weigh", text, ("ElectronicScale", *plain), "PreparationBench", None, 10.0)
    else:
        text = f"Lay out the dry {words(vessel)}; carry the closed bottles of the liquids to the hood."
        bench.do("Measure", text, (vessel,), "PreparationBench", None, 10.0)
    if dry:
        text = f"Weigh {', '.join(words(name) for name in dry)} in the glove box into a stoppered vial."
        bench.do("Weigh", text, ("SampleVial", *dry), "GloveBox", None, 15.0)
    for step in steps:
        bench.do(step.action, step.text, step.uses, step.location, step.temperature, step.duration or 10.0)


def clean_up(bench: Bench) -> None:
    """Append the last step: waste by kind, and the glassware."""
    halogens = any("halogen" in group for use in bench.reagents for group in groups_of(use.name))
    waste = "halogenated and other solvent waste apart" if halogens else "solvent and aqueous waste apart"
    bench.do("Clean", f"Collect {waste} and wash the glassware.", (), "SinkBench", None, 20.0)


def words(name: str) -> str:
    """Return how a step calls an asset."""
    asset = Catalog.load().get(name)
    written = asset.synonyms_en[0].split(" (")[0] if asset.kind == "reagent" and asset.synonyms_en else ""
    return (
        written
        or "".join(
            f" {c.lower()}" if c.isupper() and i and not name[i - 1].isupper() else c for i, c in enumerate(name)
        ).lower()
    )


def is_solid(asset: Asset) -> bool:
    """Say whether a reagent is weighed."""
    return asset.chemistry is not None and asset.chemistry.state == "solid"


def is_pyrophoric(asset: Asset) -> bool:
    """Say whether a reagent catches fire in air."""
    return asset.chemistry is not None and PYROPHORIC in asset.chemistry.h_codes


def groups_of(name: str) -> tuple[str, ...]:
    """Return the reactive groups of a reagent."""
    chemistry = Catalog.load().get(name).chemistry
    return () if chemistry is None else chemistry.groups
