"""Products that must not be made are refused by name; products that a reaction does not give are refused too."""

from __future__ import annotations

import pytest

from labgym.protocols import RefusalError
from labgym.protocols.refusals import refuse_product
from labgym.protocols.synthesis import synthesize

DANGEROUS = (
    "cumene hydroperoxide", "di-tert-butyl peroxide", "dicumyl peroxide", "tert-butyl peroxybenzoate", "peracetic acid",
    "dimethyldioxirane", "ethyl nitrate", "isosorbide dinitrate", "ethylene glycol dinitrate", "amyl nitrate",
    "allyl azide", "benzoyl azide", "phenyl azide", "tosyl azide", "azidoacetonitrile", "cyanuric triazide",
    "2,4,6-trinitrotoluene", "1,3-dinitrobenzene", "2,4-dinitrotoluene", "ethyl diazoacetate", "phenyldiazomethane",
    "benzenediazonium tetrafluoroborate", "methyl perchlorate", "ammonium perchlorate", "silver fulminate",
    "silver acetylide", "copper(I) phenylacetylide", "chloroacetylene", "nitrogen trichloride",
    "isopropyl methylphosphonofluoridate", "diisopropyl fluorophosphonate", "bis(2-chloroethyl) sulfide",
    "tris(2-chloroethyl)amine", "phosgene", "hydrogen cyanide", "nickel tetracarbonyl", "dimethylmercury",
    "methyl isocyanate", "osmium tetroxide",
)  # fmt: skip
HARMLESS = (
    "benzyl azide", "butyl azide", "hexyl azide", "cyclohexanone", "isoamyl acetate", "benzoic acid", "styrene oxide",
    "4-bromoanisole", "nitrobenzene", "silver nitrate", "methyl salicylate", "triphenylphosphine oxide",
    "2,4-dinitrophenylhydrazone", "4-chlorotoluene", "acetanilide", "benzonitrile", "diethyl phosphate", "azobenzene",
)  # fmt: skip


@pytest.mark.parametrize("name", DANGEROUS)
def test_a_dangerous_product_is_refused_by_its_name(name: str) -> None:
    with pytest.raises(RefusalError, match="no protocol makes") as refusal:
        refuse_product(f"Prepare {name} from its precursor, then distil it.")
    assert refusal.value.reason == "unsafe"
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("name", HARMLESS)
def test_an_ordinary_product_is_not_refused(name: str) -> None:
    refuse_product(f"Prepare {name} from its precursor.")


@pytest.mark.parametrize("reagent", ["sodium chlorite", "potassium chlorite", "lithium perchlorate"])
def test_salts_of_metals_that_oxidize_or_catalyze_may_be_named(reagent: str) -> None:
    refuse_product(f"Pinnick oxidation of benzaldehyde with {reagent} to benzoic acid in tert-butanol and water.")
    with pytest.raises(RefusalError, match="perchlorate or chlorate"):
        refuse_product(f"Prepare {reagent.replace(reagent.split()[0], 'ammonium')}.")


def test_a_reagent_of_the_catalog_is_not_a_product() -> None:
    text = "Oxidize styrene (1 g) with tert-butyl hydroperoxide in toluene at 40 C"
    start = text.index("tert-butyl")
    refuse_product(text, [(start, start + len("tert-butyl hydroperoxide"))])
    with pytest.raises(RefusalError, match="peroxide"):
        refuse_product(text)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("Prepare tert-butyl hydroperoxide from tert-butanol and hydrogen peroxide, then distil it", "peroxide"),
        ("制备叔丁基过氧化氢：叔丁醇与过氧化氢在硫酸中反应", "peroxide"),
        ("Prepare isopropyl nitrate from isopropyl bromide and silver nitrate", "nitrate ester"),
        ("Prepare benzyl azide from benzyl bromide and sodium azide in DMSO, then distil it under vacuum", "distilled"),
    ],
)
def test_a_dangerous_request_is_refused_with_its_reason(text: str, reason: str) -> None:
    with pytest.raises(RefusalError, match=reason):
        synthesize(text, keyword_only=True)


def test_benzyl_azide_is_written_cold_and_without_chlorinated_solvents() -> None:
    text = "Convert benzyl bromide (1.71 g) to benzyl azide with sodium azide (0.98 g) in DMSO (20 mL) at 22 C"
    assert synthesize(text, keyword_only=True).protocol.product == "benzyl azide"
    for spoilt in (text.replace("22 C", "90 C"), text.replace("DMSO", "dichloromethane")):
        with pytest.raises(ValueError, match=r"azide|explo"):
            synthesize(spoilt, keyword_only=True)


@pytest.mark.parametrize(
    ("text", "product"),
    [
        ("Synthesis of a dihydropyrimidinone derivative from a ketone, aldehyde, and urea", "dihydropyrimidinone"),
        ("Prepare a nitrile from cyclohexanone with sodium borohydride in ethanol", "nitrile"),
        ("Reduce acetophenone with sodium borohydride in ethanol to give a quinazoline", "quinazoline"),
        ("Condense benzaldehyde with acetone and NaOH in ethanol to give a thiazole", "thiazole"),
        ("Esterify benzoic acid with methanol and sulfuric acid to give benzonitrile", "benzonitrile"),
    ],
)
def test_a_product_that_the_reaction_does_not_give_is_refused_with_both_names(text: str, product: str) -> None:
    with pytest.raises(RefusalError, match=product) as refusal:
        synthesize(text, keyword_only=True)
    assert "gives the" in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "product"),
    [
        ("Esterify benzoic acid with methanol and sulfuric acid to give methyl benzoate", "methyl benzoate"),
        ("Reduce acetophenone with sodium borohydride in ethanol to give 1-phenylethanol", "1-phenylethanol"),
        ("Oxidise cyclohexanol to cyclohexanone with bleach in acetic acid, 35 C, 1 h", "cyclohexanone"),
    ],
)
def test_a_product_that_the_reaction_gives_keeps_its_name(text: str, product: str) -> None:
    assert synthesize(text, keyword_only=True).protocol.product == product
