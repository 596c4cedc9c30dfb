"""Names glued to a catalog name are other substances; mixtures, hydrates and concentrations are not."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.protocols.synthesis import read

CATALOG = Catalog.load()


@pytest.mark.parametrize(
    "name",
    [
        *("N-Boc-piperidine", "Boc-protected piperidine", "TBS-protected benzyl alcohol", "4-bromo-toluene"),
        *("toluene-d8", "d8-toluene", "[D8]toluene", "deuterated toluene", "aniline-15N", "acetophenone-13C6"),
        *("Et3N·HCl", "aniline-HCl", "BH3·THF", "polymer-bound triphenylphosphine", "silica-supported sulfuric acid"),
        *("benzaldehyde dimethyl acetal", "benzoic acid anhydride", "methyl salicylate", "N-Boc-哌啶"),
    ],
)
def test_a_derivative_is_one_substance_that_the_catalog_lacks(name: str) -> None:
    description = read(f"Treat {name} with sodium hydroxide", CATALOG)
    assert description.unlisted == (name,)
    assert [m.name for clause in description.clauses for m in clause.mentions] == ["SodiumHydroxide"]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("THF-water", {"Tetrahydrofuran", "DeionizedWater"}),
        ("10%-HCl", {"HydrochloricAcid"}),
        ("CuSO4·5H2O", {"CopperIISulfate"}),
        ("EDC·HCl", {"EDCHydrochloride"}),
        ("N-Boc-benzylamine", {"NBocBenzylamine"}),
        ("half-saturated brine", {"SodiumChloride"}),
        ("n-BuLi-hexane", {"NButyllithium", "NHexane"}),
    ],
)
def test_mixtures_hydrates_and_concentrations_name_what_they_consist_of(text: str, names: set[str]) -> None:
    description = read(f"Stir with {text}", CATALOG)
    assert description.unlisted == ()
    assert {m.name for clause in description.clauses for m in clause.mentions} == names


def test_the_volume_of_a_mixture_is_shared_out_by_its_ratio() -> None:
    clause = read("Stir in 25 mL of a 4:1 mixture of dioxane and water", CATALOG).clauses[0]
    assert clause.amounts == {"OneFourDioxane": "20 mL", "DeionizedWater": "5 mL"}


def test_a_reagent_in_solution_has_the_volume_that_follows_its_solvent() -> None:
    clause = read("Add DIBAL-H (1.0 M in hexanes, 12 mL)", CATALOG).clauses[0]
    assert clause.amounts == {"DIBALH": "12 mL of 1.0 M in hexanes"}
