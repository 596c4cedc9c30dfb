"""Procedures in English become action lists with spans; what no action owns is reported."""

from __future__ import annotations

import json
import re
import time

import pytest

from labgym.assets import Catalog
from labgym.cli.app import main
from labgym.errors import DocumentError, OptionError
from labgym.protocols.reading import ActionList
from labgym.protocols.reading.actions import MAX_TEXT
from labgym.protocols.reading.agreement import score
from labgym.protocols.reading.explain import explained, explained_html, marks
from labgym.protocols.reading.figures import figures, plain
from labgym.protocols.reading.gold import GoldText, read_gold, tuples
from labgym.protocols.reading.reader import read_procedure
from labgym.protocols.stoichiometry import Use, stoichiometry, waste

REDUCTION = (
    "To a stirred solution of 4-nitrobenzaldehyde (1.51 g, 10 mmol) in methanol (30 mL) at 0 °C was added sodium "
    "borohydride (0.38 g, 10 mmol) portionwise over 10 min. The mixture was stirred at room temperature for 2 h, then "
    "quenched with saturated aqueous NH4Cl (20 mL) and extracted with EtOAc (3 x 30 mL). The combined organic layers "
    "were washed with water and brine (20 mL), dried (MgSO4), filtered and evaporated in vacuo to give the alcohol "
    "(1.4 g, 92%) as a white solid. mp 93 °C; 1H NMR (CDCl3) 4.8 (s, 2H)."
)
LIMIT_S = 30.0
"""CPU time of a reader whose cost grows faster than its text is far above this, seconds; a second is usual."""


def brief(text: str) -> list[tuple[str, list[str]]]:
    """Return verb and materials of each action."""
    return [
        (action.verb, [f"{item.name} {item.amount}".strip() for item in (*action.takes, *action.gives)])
        for action in read_procedure(text).actions
    ]


def test_a_whole_procedure_is_read_in_order() -> None:
    assert brief(REDUCTION) == [
        ("MakeSolution", ["4-nitrobenzaldehyde 1.51 g, 10 mmol", "methanol 30 mL"]),
        ("Add", ["sodium borohydride 0.38 g, 10 mmol"]),
        ("Stir", []),
        ("Quench", ["NH4Cl 20 mL of saturated"]),
        ("Extract", ["EtOAc 3 x 30 mL"]),
        ("Wash", ["water"]),
        ("Wash", ["brine 20 mL"]),
        ("DrySolution", ["MgSO4"]),
        ("Filter", []),
        ("Concentrate", []),
        ("Yield", ["alcohol 1.4 g, 92 %"]),
        ("Analyze", []),
    ]


def test_conditions_stand_with_their_action_and_what_is_inferred_is_marked() -> None:
    actions = read_procedure(REDUCTION).actions
    addition, stirring, drying = actions[1], actions[2], actions[8]
    assert (addition.temperature, addition.duration, addition.manner) == (0.0, 10.0, "portionwise")
    assert (stirring.temperature, stirring.duration) == (22.0, 120.0)
    assert (drying.keep, drying.assumed) == ("filtrate", ("keep",))
    assert actions[4].repeats == 3
    assert actions[9].atmosphere == "vacuum"


@pytest.mark.parametrize(("place", "gas"), [("in vacuo", "vacuum"), ("in air", "air"), ("in an oven", None)])
def test_a_solid_is_dried_in_the_gas_that_the_text_names(place: str, gas: str | None) -> None:
    drying = read_procedure(f"The solid was dried {place}.").actions[0]
    assert (drying.verb, drying.atmosphere) == ("DrySolid", gas)


def test_every_span_is_the_name_that_stands_there() -> None:
    read = read_procedure(REDUCTION)
    for action in read.actions:
        assert action.span is not None
        for item in (*action.takes, *action.gives):
            assert item.span is not None
            assert read.text[slice(*item.span)] == item.name


def test_a_procedure_that_names_all_amounts_and_a_product_is_complete_with_nothing_unread() -> None:
    read = read_procedure(REDUCTION)
    assert (read.outcome, read.unread, read.product, read.result) == ("complete", (), "alcohol", "1.4 g, 92 %")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("The residue was dissolved in ethyl acetate/water.", [("Dissolve", ["ethyl acetate", "water"])]),
        ("It was dried (Na2SO4) and concentrated.", [("DrySolution", ["Na2SO4"]), ("Concentrate", [])]),
        (
            "A mixture of aniline (1 g), acetone (2 g) and iodine (3 mg) in toluene (5 mL) was heated at 80 °C for 2 h",
            [("MakeSolution", ["aniline 1 g", "acetone 2 g", "iodine 0.003 g", "toluene 5 mL"]), ("Heat", [])],
        ),
        (
            "To a solution of aniline (1 g) in THF (5 mL), triethylamine (2 mL) and acetyl chloride (1 mL) were added.",
            [("MakeSolution", ["aniline 1 g", "THF 5 mL"]), ("Add", ["triethylamine 2 mL", "acetyl chloride 1 mL"])],
        ),
        (
            "7.2 g (22 mmol) of benzoic acid was added to 30 ml. of methanol.",
            [("Add", ["methanol 30 mL"]), ("Add", ["benzoic acid 7.2 g, 22 mmol"])],
        ),
        ("The mixture was poured onto ice.", [("Pour", ["ice"])]),
        ("2 N NaOH was added to bring the pH to 9.", [("AdjustPH", ["NaOH of 2 M"])]),
        ("The product was purified by recrystallization from ethanol.", [("Recrystallize", ["ethanol"])]),
        (
            "The residue was purified by silica gel chromatography (5% MeOH/DCM).",
            [("Chromatograph", ["silica gel", "MeOH", "DCM"])],
        ),
        ("Methanol (5 mL) was added to destroy the excess of sodium borohydride.", [("Add", ["Methanol 5 mL"])]),
        ("Ethanol (2 mL) was added to dissolve the precipitated sodium chloride.", [("Add", ["Ethanol 2 mL"])]),
        (
            "It was treated with sodium hydroxide (2 g) in water (10 mL) and hydrogen peroxide (30%, 12 mL).",
            [
                ("MakeSolution", ["sodium hydroxide 2 g", "water 10 mL"]),
                ("Add", ["hydrogen peroxide 12 mL of 30 %"]),
            ],
        ),
        (
            "Benzyl alcohol was obtained from benzaldehyde (10.6 g) by treatment with sodium borohydride (1.9 g).",
            [
                ("Add", ["benzaldehyde 10.6 g"]),
                ("Add", ["sodium borohydride 1.9 g"]),
                ("Yield", ["Benzyl alcohol"]),
            ],
        ),
        (
            "Before adding hydrazine (5 mL), the mixture was cooled to 5 °C.",
            [("Cool", []), ("Add", ["hydrazine 5 mL"])],
        ),
        (
            "The ester (2 g) was added to LiAlH4 (0.5 g) in ether (20 mL), previously cooled to 0 °C.",
            [("MakeSolution", ["LiAlH4 0.5 g", "ether 20 mL"]), ("Cool", []), ("Add", ["ester 2 g"])],
        ),
        (
            "The ethyl acetate layer was isolated and the heptane solution was separated.",
            [("CollectLayer", []), ("CollectLayer", [])],
        ),
        ("Then two 50 ml. portions of ether were added.", [("Add", ["ether 2 x 50 mL"])]),
        (
            "The oil was distilled under reduced pressure to give 2.5 g of an oil, b.p. 80-84 °C (0.2 mm).",
            [("Distill", []), ("Yield", ["oil 2.5 g"])],
        ),
        ("Palladium (II) acetate (9 mg) was added.", [("Add", ["Palladium (II) acetate 0.009 g"])]),
        ("Copper(I) iodide (9 mg) was added.", [("Add", ["Copper(I) iodide 0.009 g"])]),
        ("0.5 g of 10% palladium on charcoal was added.", [("Add", ["palladium on charcoal 0.5 g of 10 %"])]),
        (
            "Aniline (1 g) followed by acetone (2 g) and iodine (3 mg) were added.",
            [("Add", ["Aniline 1 g", "acetone 2 g", "iodine 0.003 g"])],
        ),
        ("Half of it was evaporated and 20 mL of water added.", [("Concentrate", []), ("Add", ["water 20 mL"])]),
        (
            "Then aniline (0.8 g, 9 mmol in 25 mL of ethanol) was added.",
            [("MakeSolution", ["aniline 0.8 g, 9 mmol", "ethanol 25 mL"]), ("Add", [])],
        ),
        (
            "Reaction of aniline (1 g) with acetone (2 g) in toluene (5 mL) at 80 °C for 2 h gave the imine (1 g).",
            [("Add", ["aniline 1 g", "acetone 2 g", "toluene 5 mL"]), ("Stir", []), ("Yield", ["imine 1 g"])],
        ),
        (
            "The imine was prepared in 80% yield by stirring aniline (1 g) in acetone (5 mL) for 2 h.",
            [("MakeSolution", ["aniline 1 g", "acetone 5 mL"]), ("Stir", [])],
        ),
        ("The solvent was distilled off.", [("Concentrate", [])]),
        ("The oil was separated and purified by column chromatography (hexane).", [("Chromatograph", ["hexane"])]),
        ("1 N-hydrochloric acid (3 mL) was added.", [("Add", ["hydrochloric acid 3 mL of 1 M"])]),
        (
            "An ester (52 g) was added to a suspension prepared from 14 g of sodium hydride and 130 mL of toluene.",
            [("Add", ["sodium hydride 14 g", "toluene 130 mL"]), ("Add", ["ester 52 g"])],
        ),
        (
            "An amine (5 g), prepared as described in Example 7, is dissolved in acetone (15 mL).",
            [("Dissolve", ["amine 5 g", "acetone 15 mL"])],
        ),
        (
            "NaOH (5 mL) was added to an ethanol solution (120 mL) of 3.5 g of phenol.",
            [("MakeSolution", ["ethanol 120 mL", "phenol 3.5 g"]), ("Add", ["NaOH 5 mL"])],
        ),
        ("It was recrystallized (from ethanol/water).", [("Recrystallize", ["ethanol", "water"])]),
        ("Phenol [8.5 g; boiling point: 182 °C] was added.", [("Add", ["Phenol 8.5 g"])]),
        (
            "It was filtered, the filtrate washed with water and dried, the solvent removed.",
            [("Filter", []), ("Wash", ["water"]), ("DrySolution", []), ("Concentrate", [])],
        ),
        ("Zinc chloride, 1 mol, was added a drop at a time.", [("Add", ["Zinc chloride 1 mol"])]),
        ("(2S, 4S)-4-phenoxyproline (1 g) was added.", [("Add", ["(2S, 4S)-4-phenoxyproline 1 g"])]),
        (
            "The resulting acid chloride was dissolved in ether (5 mL).",
            [("Dissolve", ["acid chloride", "ether 5 mL"])],
        ),
    ],
)
def test_a_construction_is_read(text: str, expected: list[tuple[str, list[str]]]) -> None:
    assert brief(text) == expected


def test_periods_stay_in_sequence() -> None:
    (heating,) = read_procedure("The mixture was heated at 50 °C for 1 h and then at 10 °C for 2 h.").actions
    assert [(item.temperature, item.duration) for item in heating.periods] == [(50.0, 60.0), (10.0, 120.0)]


def test_unrolled_actions_have_one_period_each() -> None:
    text = "Aniline (1 g) in water (10 mL) was heated at 50 °C for 1 h and then at 10 °C for 2 h to give a solid (1 g)."
    experiment = read_procedure(text).experiment("x", "x").unrolled()
    periods = [(action.verb, action.temperature, action.duration) for action in experiment.actions if action.duration]
    assert periods == [("Heat", 50.0, 60.0), ("Heat", 10.0, 120.0)]
    assert not any(action.then for action in experiment.actions)


@pytest.mark.parametrize(
    "text",
    [
        "The title compound was prepared from aniline (1 g) by the procedure described in Example 3.",
        "Following the general procedure A, aniline (1 g) gave the amide (1.2 g).",
        "In a manner analogous to Example 7, Step B, the amine was obtained.",
        "Following General Procedure B′ above, and using aniline, the title compound was prepared.",
        "As for Example 8, aniline is coupled to proline.",
        "The procedure was the same as that for preparing anisole in Example 3.",
        "The amine (1 g), obtained as described in Example 4, was reacted in a similar manner to that in Example 8.",
        "According to the same method as Example 1, aniline (1 g) was added to water (5 mL).",
        "By following essentially the procedure of Example 7, Part B, the amine was prepared from aniline.",
        "Aniline (1 g) was reacted in accordance with Example 36, yielding the amide.",
        "Aniline (1 g) is heated with acetone (2 g). The procedure described in Example 1 is followed.",
    ],
)
def test_a_text_that_leans_on_another_ends_in_refers(text: str) -> None:
    read = read_procedure(text)
    assert read.outcome == "refers"
    assert any(action.verb == "Refers" for action in read.actions)


@pytest.mark.parametrize(
    "text",
    [
        "The amine (1 g, prepared as described in Example 3) was dissolved in ether (5 mL).",
        "The amine (1 g), prepared according to the method described in J. Org. Chem. 1990, was dissolved in ether.",
        "The amine was obtained as an oil, identical to anisole.",
        "A reactor equipped as described in Example 1 was charged with 2 g of aniline, made into a salt.",
        "2 g of anisole prepared as above was dissolved in ether.",
        "It was made by a procedure in which aniline (2 g) was added.",
    ],
)
def test_where_a_starting_material_came_from_is_no_reference(text: str) -> None:
    assert read_procedure(text).outcome != "refers"


@pytest.mark.parametrize(
    "lost", ["with 3.7 quux of water", "and aniline (1 g) was present", "although 5 mL remained of it"]
)
def test_what_no_action_owns_is_reported(lost: str) -> None:
    read = read_procedure(REDUCTION.replace(" mp 93", f" The next day it was so {lost}. mp 93"))
    number = re.search(r"[\d.]+", lost)
    assert number is not None
    assert any(number[0] in item.text for item in read.unread)


@pytest.mark.parametrize(
    "text, amounts",
    [
        ("The ester (1 g) was dissolved in EtOH/H2O/AcOH (26 mL/3 mL/1.0 mL).", ["1 g", "26 mL", "3 mL", "1 mL"]),
        ("The ester (1 g) was dissolved in toluene/ethanol/water (50/5/5 ml).", ["1 g", "50 mL", "5 mL", "5 mL"]),
        ("The ester (1 g) was dissolved in a 2:1 mixture of ether and hexane (30 mL).", ["1 g", "20 mL", "10 mL"]),
        ("The ester (1 g) was dissolved in THF/MeOH (1:1, 30 mL).", ["1 g", "15 mL", "15 mL"]),
        ("The ester (1 g) was dissolved in water (9 mL)/ammonium hydroxide (6 mL).", ["1 g", "9 mL", "6 mL"]),
        ("The ester (1 g) in ether (5 mL) was washed with water (2x50 mL).", ["1 g", "5 mL", "2 x 50 mL"]),
        ("The ester (1 g) in ether (5 mL) was washed with HCl and brine (9 mL each).", ["1 g", "5 mL", "9 mL", "9 mL"]),
        ("Oil (1 g) in ether (5 mL) was extracted with two -- 50 ml portions of HCl.", ["1 g", "5 mL", "2 x 50 mL"]),
        ("100 Mg. of phenol in 15 ml. of benzene is treated with 60 mg. of aniline.", ["0.1 g", "15 mL", "0.06 g"]),
        ("The ester (1 g, purity: 84%, 1 mol) was added to water (9 mL).", ["9 mL", "1 g, 1 mol"]),
        ("The oil (1 g) was washed with 9 mL each of water, 1 N HCl, brine.", ["1 g", "9 mL", "9 mL of 1 M", "9 mL"]),
        ("The oil (1 g) was washed with water and brine, 9 mL each, and dried.", ["1 g", "9 mL", "9 mL"]),
        ("A mixture of 1.4 g. (1 mol) of phenol and 3 g. K2CO3 was stirred.", ["1.4 g, 1 mol", "3 g"]),
        ("Sodium hydride (60% in mineral oil, 2 g) was added.", ["2 g of 60 %"]),
        ("9 mmol each of phenol and aniline were stirred in ether (5 mL).", ["9 mmol", "9 mmol", "5 mL"]),
        ("The ester (1 g) was dissolved in toluene-ethanol-water (20-2-3 ml).", ["1 g", "20 mL", "2 mL", "3 mL"]),
        ("To it was added BuLi (1.6 M, hexane solution) (9 mL).", ["9 mL of 1.6 M", ""]),
        ("1 g (2 mmol) sodium hydride, 60% oil dispersion, were added.", ["1 g of 60 %, 2 mmol"]),
        ("9 mmol of oil from Step A and 8 mmol of aniline in ether (5 mL) were stirred.", ["9 mmol", "8 mmol", "5 mL"]),
    ],
)  # fmt: skip
def test_each_liquid_of_a_mixture_or_a_list_has_its_own_amount(text: str, amounts: list[str]) -> None:
    actions = read_procedure(text)
    assert [portion.amount for action in actions.actions for portion in action.takes] == amounts
    assert not actions.unread


@pytest.mark.parametrize(
    "text, verbs",
    [
        ("Toluene (5 mL) was distilled off and the solvent was removed by distillation.", "Concentrate Concentrate"),
        ("The product (5 g) was distilled off at 80 °C.", "Yield Distill"),
        ("The filtrate was taken to dryness.", "Concentrate"),
        ("To it was added dried 10% palladium on carbon (1.2 g).", "Add"),
        ("The crystals which formed were removed by filtration. It was dried in vacuo.", "Filter DrySolid"),
        ("The mixture was stirred for 1 h while adding water (2 mL).", "Add Stir"),
        ("It was stirred for 30 min at room temperature and then for 2 h at reflux.", "Stir Reflux"),
        ("The oil was washed with water, followed by brine (20 mL).", "Wash Wash"),
        ("The solid was air-dried.", "DrySolid"),
        ("The oil was dissolved in ether. It was separated on silica gel.", "Dissolve Chromatograph"),
        ("To a flask equipped with a stirrer, a trap and a condenser is charged 5 g of phenol.", "Add"),
        ("With rapid stirring 16 g of phenol were added.", "Add"),
        ("The solid (3 g) was used without further purification.", "Yield"),
        ("Bulb-to-bulb distillation (80 °C/0.05 mmHg) afforded anisole (5 g).", "Distill Yield"),
        ("It was passed through a pad of silica gel (10 g).", "Filter"),
        ("It was distilled under reduced pressure to remove toluene.", "Concentrate"),
        ("After concentration of the filtrate in vacuo, the residue was dried in vacuo.", "Concentrate DrySolid"),
        ("Take up the residue in ether and wash with water.", "Dissolve Wash"),
        ("It was shaken under hydrogen in the presence of PtO2 (0.6 g).", "Add Hydrogenate"),
        ("The phase was covered with ether (50 mL) and adjusted to pH 2 by adding HCl.", "Add AdjustPH"),
        ("The extract was dried by passage through sodium sulfate.", "DrySolution"),
        ("After 1 h at 25 °C then 17 h at 5 °C t.l.c. indicated the reaction was complete.", "Wait Monitor"),
        ("It was then extracted by shaking three times with ether (5 mL).", "Extract"),
        ("After water was added to the residue, the mixture was filtered.", "Add Filter"),
        ("The resulting anisole thus obtained was filtered off. Dimethylamine was evolved.", "Filter"),
        ("It was concentrated to a tan solid (1.59 g).", "Concentrate Yield"),
        ("The filtered solution was evaporated.", "Filter Concentrate"),
        ("It was filtered. Evaporation of the filtered solution gave a solid (1 g).", "Filter Concentrate Yield"),
        ("Evaporation of the dried (MgSO4) extracts gave an oil (1 g).", "DrySolution Concentrate Yield"),
        ("The mixture was run in a microwave for 1 h at 100 °C.", "Microwave"),
        ("The hydrogenation was carried out at 25 °C for 3 h.", "Hydrogenate"),
        ("The reaction was carried out at 60 °C for 3 h.", "Wait"),
        ("The mixture was quenched over ice/water.", "Quench"),
        ("The solid was added to water and ether.", "Pour"),
        ("It was filtered to remove anisole (5.2 g). The filtrate was evaporated.", "Filter Concentrate"),
        ("It was kept at reflux while the water was separated by means of a water separator.", "Reflux"),
        ("It was evaporated to give an oil (1 g). It is 4-methylanisole, soluble in water.", "Concentrate Yield"),
        ("It was filtered and purified by column chromatography.", "Filter Chromatograph"),
        ("It was stirred with a saturated solution of hydrogen chloride in ether (4 mL) for 3 h.", "Add Stir"),
        ("It was stirred under hydrogen for 3 h.", "Hydrogenate"),
        ("It was dissolved in ether. Air is bubbled through the solution for 3 h.", "Dissolve Purge"),
        ("A mixture of 5 g of aniline and 2 mL of acetone gives a yellow precipitate.", "MakeSolution"),
        ("It was evaporated to give anisole in the form of a white solid (3.4 g, 80%).", "Concentrate Yield Yield"),
        ("It was evaporated, leaving 4-methylanisole.", "Concentrate Yield"),
        ("It was washed with water and brine, then was dried over MgSO4.", "Wash Wash DrySolution"),
        ("Sodium hydride (80 mg, prewashed with hexane) was added.", "Wash Add"),
        ("To the residue water (5 mL) was added.", "Add"),
        ("The solution was drowned in ice water.", "Pour"),
        ("The solid was colllected and air dried giving anisole.", "Filter DrySolid Yield"),
        ("It was dried over MgSO4. The catalyst was removed and it was evaporated.", "DrySolution Filter Concentrate"),
        ("It was washed with brine and stirred over MgSO4 for 1 h.", "Wash DrySolution"),
        ("After drying, 5.5 g of anisole of melting point 37 °C are obtained.", "DrySolution Yield"),
        ("Take the solid up in ether.", "Dissolve"),
        ("The crystals were washed with ether (5.29 g, 80%, m.p. 164 °C).", "Wash Yield Analyze"),
        ("The crystals were washed with water: 23 g (89%) of product.", "Wash Yield"),
        ("After 8 hours of reflux, it was cooled.", "Reflux Cool"),
        ("It was evaporated. The product crystallized (25.2 g, m.p. 125 °C).", "Concentrate Crystallize Yield Analyze"),
        ("It was stirred using a dry-ice condenser.", "Stir"),
    ],
)  # fmt: skip
def test_an_operation_is_what_the_words_around_it_say(text: str, verbs: str) -> None:
    actions = read_procedure(f"Phenol (1 g) was added to water (9 mL). {text}")
    assert [action.verb for action in actions.actions[2:]] == verbs.split()
    assert not actions.unread


@pytest.mark.parametrize(
    ("text", "field", "value"),
    [
        ("Water (5 mL) was added in a stream of argon.", "atmosphere", "argon"),
        ("Water (5 mL) was added. This was exothermic to 45 °C.", "note", "exothermic to 45 °C"),
        ("It was purified by chromatography (eluent: toluene).", "takes", "toluene"),
        ("It was crystallized from ethanol (charcoal).", "takes", "charcoal"),
        ("It was purified on silica gel with 4%MeOH/CH2Cl2.", "takes", "CH2Cl2"),
        ("To it was added DIBAL (1.0M hexanes, 9 mL) dropwise.", "takes", "hexanes"),
        ("A cold solution (4 mL) of hydrogen chloride in ether was added.", "takes", "4 mL"),
    ],
)
def test_what_a_text_tells_beside_an_operation_stands_in_its_action(text: str, field: str, value: str) -> None:
    read = read_procedure(f"Phenol (1 g) was added to water (9 mL). {text}")
    assert any(value in str(getattr(action, field)) for action in read.actions[2:])
    assert not read.unread


@pytest.mark.parametrize("bracket", ["some drops of DMF", "NH3 0.5 %", "charcoal"])
def test_what_a_bracket_adds_is_no_remark(bracket: str) -> None:
    read = read_procedure(f"Phenol (1 g) was added to water (9 mL). It was diluted with ether ({bracket}).")
    assert [item.text for item in read.unread if item.why.startswith("name")] == [
        bracket.split()[-1 if "of" in bracket else 0]
    ]


@pytest.mark.parametrize(
    "text, lost",
    [
        ("The ester (1 g) and sodium hydride (0.28, 1.65 mmol) in DMF (4 mL) were stirred for 2 h.", "0.28"),
        ("Sodium methylate (prepared by mixing sodium (2.3 g) in methanol) was added to the ester (1 g).", "2.3 g"),
        ("Aqueous 70% (77.1 g, 0.6 mol) tungsten trioxide (1.4 g, 0.01 mol) was added to oil (1 g).", "77.1 g"),
    ],
)  # fmt: skip
def test_a_quantity_that_no_action_states_or_of_which_the_owner_is_unclear_is_unread(text: str, lost: str) -> None:
    actions = read_procedure(text)
    assert actions.outcome == "partial"
    assert any(lost in f"{item.text} {item.why}" for item in actions.unread)


def test_an_action_list_may_not_claim_a_span_outside_its_text() -> None:
    with pytest.raises(ValueError, match="does not lie in the text"):
        ActionList(text="Stir.", actions=({"verb": "Stir", "span": (0, 9)},), outcome="partial")


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("1,500 ml", "volume", 1500.0),
        ("two (2) hours", "time", 120.0),
        ("ten mmole", "substance", 0.01),
        ("0°-5° C.", "temperature", 2.5),
        ("-5 to +5° C.", "temperature", 0.0),
        ("-78 °C", "temperature", -78.0),
        ("21/2 hours", "time", 150.0),
        ("half an hour", "time", 30.0),
        ("Eight grams", "mass", 8.0),
        ("0.5 wt %", "percent", 0.5),
        ("20mM", "molarity", 0.02),
        ("10 mol%", "equivalents", 0.1),
        ("740µL", "volume", 0.74),
        ("2.6×10 -4 mol", "substance", 2.6e-4),
        ("133 Pa", "pressure", 133e-5),
        ("pH of 7.5-8.5", "ph", 8.0),
        ("pH of the aqueous layer was adjusted to 2", "ph", 2.0),
        ("45 lbs/sq in", "pressure", 3.10264),
        ("26 millimeters of mercury", "pressure", 0.0346638),
        ("overnight", "time", 960.0),
        ("0.1 Mol", "substance", 0.1),
        ("100 mls", "volume", 100.0),
        ("50 weight percent", "percent", 50.0),
        ("25 ml/min", "other", 25.0),
        ("Dry Ice-acetone bath", "temperature", -78.0),
    ],
)
def test_a_figure_is_read_in_base_units(text: str, kind: str, value: float) -> None:
    (figure,) = figures(plain(text))
    assert (figure.kind, figure.value) == (kind, pytest.approx(value, rel=1e-3))


def test_amounts_that_a_comma_parts_without_a_space_are_all_read() -> None:
    assert [figure.text for figure in figures("aniline (1.0 mL,1.1 g,12 mmol)")] == ["1.0 mL", "1.1 g", "12 mmol"]


def test_a_fused_ring_is_no_optical_rotation() -> None:
    assert brief("6H-Benzo[a]carbazole (0.4 g) was added to water (10 mL).") == [
        ("Add", ["water 10 mL"]),
        ("Add", ["6H-Benzo[a]carbazole 0.4 g"]),
    ]


@pytest.mark.parametrize("text", ["2-methyl-1H-indole", "[1,3]dioxane-5-one", "N-(4-chloro-2-fluoro)amide"])
def test_numbers_in_names_are_no_figures(text: str) -> None:
    assert figures(plain(text)) == []


@pytest.mark.cases(3)
@pytest.mark.parametrize(
    "part",
    [
        "(", "(a ", "1 ", "1-", "1.", "5 mL ", "5 ml of water, ", "C1", "CH2", " ", "a-", "water/", "was added ",
        "to a solution of ", "1 x ", "1:", "pH of ", "procedure of the ", "as described in the ", "2-methyl-",
        "water and ", "0°-", "removed by ", "A. ", "such as ", "NMR ", "water, m.p. ", "[", "C 6H ",
        "Water (5 mL) was added and it was stirred for 2 h. ",
    ],
)  # fmt: skip
def test_a_text_of_the_greatest_length_does_not_hang(part: str) -> None:
    text = (part * MAX_TEXT)[:MAX_TEXT]
    read_procedure(REDUCTION)
    start = time.process_time()
    read_procedure(text)
    assert time.process_time() - start < LIMIT_S


def test_a_longer_text_is_refused() -> None:
    with pytest.raises(OptionError, match="at most 20000 are read"):
        read_procedure("a" * (MAX_TEXT + 1))


def gold_of(text: str, read: ActionList) -> GoldText:
    return GoldText("a", text, read.outcome, tuple(tuples(read)))


def test_a_reading_agrees_with_itself() -> None:
    read = read_procedure(REDUCTION)
    result = score([(gold_of(REDUCTION, read), read)])
    assert (result.strict, result.gold, result.conditions, result.order) == (
        result.read,
        result.read,
        result.gold_conditions,
        1.0,
    )
    assert (result.invented, result.lost, dict(result.grades)) == (0, 0, {"A": 1})


def test_a_missing_and_a_changed_tuple_lower_the_score_as_counted() -> None:
    read = read_procedure(REDUCTION)
    changed = read.actions[1].model_copy(
        update={"takes": (read.actions[1].takes[0].model_copy(update={"amount": "9 g"}),)}
    )
    worse = read.model_copy(update={"actions": (read.actions[0], changed, *read.actions[3:])})
    result = score([(gold_of(REDUCTION, read), worse)])
    assert (result.gold, result.read, result.strict, result.relaxed) == (13, 12, 11, 12)
    assert result.lost == 2
    assert result.grades["C"] == 1


def test_a_lost_part_or_repeat_lowers_its_own_figure_alone() -> None:
    read = read_procedure("The mixture was filtered and the solid washed twice with ether.")
    gold = gold_of(read.text, read)
    lost = [action.model_copy(update={"keep": None, "repeats": 1}) for action in read.actions]
    right, wrong = (score([(gold, item)]) for item in (read, read.model_copy(update={"actions": tuple(lost)})))
    assert (right.kept, right.repeats) == ((1, 1), (1, 1))
    assert (wrong.kept, wrong.repeats, wrong.strict) == ((1, 0), (1, 0), right.strict)


@pytest.mark.parametrize(
    "text, keep",
    [
        ("The mixture was filtered. The filtrate was concentrated.", "filtrate"),
        ("The solid was filtered and washed with ether, and the filtrates were evaporated.", "filtrate"),
        ("The mixture was filtered to remove the catalyst, and cooled to 0 °C.", "filtrate"),
        ("The undissolved material was filtered off and dried in vacuo.", "precipitate"),
        ("The filter cake was discarded after the urea was removed by filtration.", "filtrate"),
        ("The mixture was filtered and the solid was recrystallized from ethanol.", "precipitate"),
        ("The crystalline product was removed by filtration, washed with methanol and dried.", "precipitate"),
        ("The liquid was decanted and the residue was recrystallized from ethanol.", "precipitate"),
        ("It was dried (Na2SO4), decanted and evaporated.", "filtrate"),
        ("It was stirred for 3 days and is then filtered, diluted with water and extracted with ether.", "filtrate"),
        ("It was cooled, filtered from the solid precipitate and concentrated.", "filtrate"),
        ("The solids were filtered off and washed with ether. Removal of the solvent gave an oil.", "filtrate"),
        ("The solid was collected by filtration then partitioned between ether and water.", "precipitate"),
        (
            "The crystals were filtered to give 3 g of A. The mother liquor was evaporated to give 1 g of A.",
            "precipitate",
        ),
    ],
)
def test_a_filtration_keeps_the_part_that_goes_on(text: str, keep: str) -> None:
    assert [action.keep for action in read_procedure(text).actions if action.verb == "Filter"] == [keep]


@pytest.mark.parametrize(
    "end",
    [
        "The mixture was filtered and heated at 50 °C for 1 h to give anisole (3 g).",
        "The solid was filtered and dried to give anisole (3 g). The filtrate was concentrated.",
        "Zinc chloride was separated. The mixture was concentrated to give anisole (3 g).",
    ],
)
def test_where_it_is_not_clear_which_part_goes_on_the_text_is_partial(end: str) -> None:
    begin = "Phenol (9.4 g) was added to methanol (50 mL). "
    read = read_procedure(begin + end)
    assert read.outcome == "partial"
    assert any("not clear" in item.why for item in read.unread)
    assert (
        read_procedure(f"{begin}The mixture was filtered and evaporated to yield anisole (3 g).").outcome == "complete"
    )


def test_the_repeats_of_a_list_belong_to_their_liquid() -> None:
    text = "It was washed with water (50 mL), twice with 1 N NaOH (25 mL) and with brine (3 x)."
    washes = read_procedure(text).actions
    assert [(wash.takes[0].name, wash.repeats) for wash in washes] == [("water", 1), ("NaOH", 2), ("brine", 3)]
    assert washes[1].takes[0].amount == "2 x 25 mL of 1 M"


def test_swapped_actions_lower_the_order() -> None:
    read = read_procedure(REDUCTION)
    swapped = read.model_copy(update={"actions": tuple(reversed(read.actions))})
    assert score([(gold_of(REDUCTION, read), swapped)]).order < -0.8


def test_a_gold_file_is_checked_against_its_texts(tmp_path) -> None:
    gold, texts = tmp_path / "gold.jsonl", tmp_path / "texts.jsonl"
    line = {"id": "a", "hash": "0" * 16, "outcome": "partial", "tuples": []}
    gold.write_text(json.dumps(line) + "\n")
    texts.write_text(json.dumps({"id": "a", "text": "Stir."}) + "\n")
    with pytest.raises(DocumentError, match="no text"):
        read_gold(gold)
    with pytest.raises(DocumentError, match="another hash"):
        read_gold(gold, texts)


def test_a_gold_file_is_scored_on_the_command_line(tmp_path, capsys) -> None:
    text = "Water (5 mL) was added at 20 °C."
    item = {
        "order": 1, "op": "Add", "substance": "Water", "substance_span": [0, 5],
        "amount": [{"value": 5, "unit": "mL"}], "conditions": [{"kind": "T", "value": 20}],
    }  # fmt: skip
    gold = tmp_path / "gold.jsonl"
    gold.write_text(json.dumps({"id": "a", "text": text, "outcome": "partial", "tuples": [item]}) + "\n")
    assert main(["protocols", "score-reading", str(gold)]) == 0
    assert "strict tuple F1 1.000" in capsys.readouterr().out


def test_an_explanation_marks_spans_and_escapes_the_text() -> None:
    read = read_procedure("Water (5 mL) was added <b>slowly</b>. There were 3.5 quux of it.")
    page = explained_html(read)
    assert "<b>" not in page
    assert 'class="substance"' in page
    assert "[[3.5]]" in explained(read, color=False)
    assert "\033[32mWater\033[0m" in explained(read)
    starts = [mark.start for mark in marks(read)]
    assert starts == sorted(set(starts))


def test_new_explains_a_procedure_and_writes_a_page(tmp_path, capsys) -> None:
    assert main(["protocols", "new", REDUCTION, "--explain"]) == 0
    shown = capsys.readouterr().out
    assert "outcome: complete" in shown
    assert "stoichiometry" in shown
    page = tmp_path / "page.html"
    assert main(["protocols", "new", REDUCTION, "--explain", "--out", str(page)]) == 0
    assert page.read_text().startswith("<!doctype html>")


def test_equivalents_follow_from_mass_volume_and_molarity() -> None:
    catalog = Catalog.load()
    rows = stoichiometry(
        [
            Use("Benzaldehyde", "10.61 g", "reactant", catalog.get("Benzaldehyde")),
            Use("base", "100 mL of 2 M", "base"),
            Use("catalyst", "5 mol%", "catalyst"),
            Use("Ethanol", "20 mL", "solvent", catalog.get("Ethanol")),
        ]
    )
    assert [row.name for row in rows] == ["Benzaldehyde", "base", "catalyst"]
    assert [row.equivalents for row in rows] == [1.0, pytest.approx(2.0, rel=2e-3), 0.05]
    assert [row.limiting for row in rows] == [True, False, False]
    assert rows[0].moles == pytest.approx(10.61 / 106.12, rel=1e-3)
    assert rows[2].moles == pytest.approx(0.005, rel=1e-3)


def test_waste_is_parted_by_what_it_is() -> None:
    catalog = Catalog.load()
    uses = [
        Use("Dichloromethane", "3 x 20 mL", "extraction solvent", catalog.get("Dichloromethane")),
        Use("Ethanol", "10 mL", "solvent", catalog.get("Ethanol")),
        Use("DeionizedWater", "50 mL", "wash", catalog.get("DeionizedWater")),
        Use("SodiumSulfate", "5 g", "drying agent", catalog.get("SodiumSulfate")),
    ]
    assert [(item.kind, item.milliliters, item.grams) for item in waste(uses)] == [
        ("halogenated solvents", 60.0, 0.0),
        ("organic solvents", 10.0, 0.0),
        ("aqueous", 50.0, 0.0),
        ("solids", 0.0, 5.0),
    ]


@pytest.mark.parametrize(
    ("text", "verb", "conditions"),
    [
        ("Degassed by bubbling argon through it for 20 min.", "Purge", (None, 20.0, "argon", None)),
        (
            "Water (5 mL) was added in small portions to an ice-cold solution of urea (1 g) in THF (10 mL).",
            "Add",
            (0.0, None, None, "portionwise"),
        ),
        ("The mixture was cooled in ice.", "Cool", (0.0, None, None, None)),
        ("Heating at reflux was continued for 30 min.", "Reflux", (None, 30.0, None, None)),
        (
            "The vial was irradiated in a microwave reactor at 120 °C for 20 min.",
            "Microwave",
            (120.0, 20.0, None, None),
        ),
        ("It was stirred for 30 min before aniline (1 g) was added over 5 minutes.", "Add", (None, 5.0, None, None)),
        ("The reaction was quenched by the careful addition of water (10 mL).", "Quench", (None, None, None, "slowly")),
    ],
)
def test_conditions_belong_to_the_operation_that_the_text_says(text: str, verb: str, conditions: object) -> None:
    (found,) = (action for action in read_procedure(text).actions if action.verb == verb)
    assert (found.temperature, found.duration, found.atmosphere, found.manner) == conditions
