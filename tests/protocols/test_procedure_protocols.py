"""A procedure becomes a protocol that embeds its substances; a gap is named and stops it."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.protocols.contents import situations
from labgym.protocols.errors import RefusalError
from labgym.protocols.reading.reader import read_procedure
from labgym.protocols.refusals import is_ordinary_dinitro, refuse_to_make, refuse_wish
from labgym.protocols.substances import Resolver
from labgym.protocols.synthesis.procedures import compile_procedure, is_procedure, prepared

NAMES = Resolver(Catalog.published(), databases=False, parser=False)
REDUCTION = (
    "To a solution of benzophenone (1.82 g, 10 mmol) in methanol (30 mL) at 0 °C was added sodium borohydride "
    "(0.38 g, 10 mmol) portionwise. The mixture was stirred at 22 °C for 2 h and concentrated. The residue was "
    "dissolved in ethyl acetate (50 mL), washed with water (20 mL) and brine (20 mL), dried over magnesium sulfate, "
    "filtered and concentrated to give benzhydrol (1.7 g, 92%) as a white solid."
)


def test_a_complete_procedure_is_written_with_what_it_collects() -> None:
    made = compile_procedure(REDUCTION, names=NAMES)
    assert made.protocol is not None
    assert made.lacks == ()
    assert made.protocol.product == "benzhydrol"
    assert any("benzhydrol 1.7 g, 92 %" in step.text for step in made.protocol.steps)


def test_a_gap_blocks_the_protocol_or_marks_it() -> None:
    text = f"{REDUCTION} The product was purified as described in Example 3."
    blocked = compile_procedure(text, names=NAMES)
    assert blocked.protocol is None
    assert any("refers to another procedure" in line for line in blocked.lacks)
    marked = compile_procedure(text, partial=True, names=NAMES).protocol
    assert marked is not None
    assert set(blocked.lacks) <= set(marked.partial)


def test_a_wet_layer_that_is_distilled_is_dried_and_the_drying_is_assumed() -> None:
    text = REDUCTION.replace("dried over magnesium sulfate, filtered and concentrated", "concentrated and distilled")
    experiment, notes, _ = prepared(read_procedure(text))
    assert experiment is not None
    drying = next(action for action in experiment.actions if action.verb == "DrySolution")
    assert (drying.assumed, [item.assumed for item in drying.takes]) == (("verb",), [True])
    assert any("is dried" in note for note in notes)


@pytest.mark.parametrize(
    ("text", "unread"),
    [
        ("N-Bromosuccinimide (NBS) (1.0 g) was added. The mixture was stirred for 1 h.", False),
        ("The oil was dissolved in ether (5 mL). The ether solution was washed with water (5 mL).", False),
        ("The hexane layer was washed with water (5 mL).", False),
        ("The oil was dissolved in ether (5 mL). The aldehyde was consumed.", True),
    ],
)
def test_a_name_that_describes_the_batch_or_repeats_a_name_is_read(text: str, unread: bool) -> None:
    assert bool(read_procedure(text).unread) is unread


def test_a_catalytic_oxidant_and_a_dinitro_reagent_are_taken_and_their_kinds_are_not_made() -> None:
    pytest.importorskip("rdkit")
    assert is_ordinary_dinitro("N#Cc1c([N+](=O)[O-])cccc1[N+](=O)[O-]")
    assert not is_ordinary_dinitro("Oc1ccc([N+](=O)[O-])cc1[N+](=O)[O-]")
    assert not is_ordinary_dinitro("Cc1c([N+](=O)[O-])cc([N+](=O)[O-])cc1[N+](=O)[O-]")
    for product in ("osmium tetroxide", "2,6-dinitrobenzonitrile"):
        with pytest.raises(RefusalError):
            refuse_to_make(product, product)


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("Copper nitrate (1 g) was dissolved in water, and benzene was added.", False),
        ("Nitrate toluene with mixed acid.", True),
        ("Potassium nitrate was added to toluene.", True),
        ("A solution of \u03b1-hydroxy-\u03b3-butyrolactone in THF.", False),
        ("Make it from \u03b3-butyrolactone.", True),
        ("Make it from gamma-butyrolactone.", True),
    ],
)
def test_a_wish_is_for_the_product_and_not_for_a_salt_or_a_derivative(text: str, refused: bool) -> None:
    try:
        refuse_wish(text)
    except RefusalError:
        assert refused
    else:
        assert not refused


def test_a_solution_made_aside_meets_the_batch_when_it_is_added() -> None:
    text = (
        "Benzoyl chloride (1.4 g, 10 mmol) was dissolved in dichloromethane (20 mL). A solution of aniline (0.93 g, "
        "10 mmol) in dichloromethane (10 mL) was added dropwise at 0 °C. The mixture was stirred for 2 h and filtered. "
        "The filtrate was concentrated."
    )
    made = compile_procedure(text, names=NAMES)
    assert made.protocol is not None
    assert any("does not name what is isolated" in note for note in made.notes)
    followed = situations(made.protocol, NAMES.catalog.including(made.protocol.substances))
    aside = next(item for item in followed if "separate vessel" in item.step.text)
    added = next(item for item in followed if "made aside" in item.step.text)
    assert set(aside.contents) == {"Aniline", "Dichloromethane"}
    assert {"Aniline", "BenzoylChloride"} <= set(added.contents)
    assert aside.vessel != added.vessel
    assert "first transfer" not in aside.step.text


def test_of_two_solutions_made_aside_none_is_forgotten() -> None:
    text = (
        "Benzoyl chloride (1.4 g, 10 mmol) was dissolved in dichloromethane (20 mL). To the mixture was added a "
        "solution of aniline (0.93 g, 10 mmol) in dichloromethane (10 mL), followed by a solution of triethylamine "
        "(1.0 g, 10 mmol) in dichloromethane (5 mL). The mixture was stirred for 2 h and concentrated."
    )
    protocol = compile_procedure(text, names=NAMES).protocol
    assert protocol is not None
    steps = sorted(protocol.steps, key=lambda step: (step.index > 2) * ("separate vessel" not in step.text))
    steps = [step.model_copy(update={"index": place}) for place, step in enumerate(steps, start=1)]
    followed = situations(protocol.model_copy(update={"steps": tuple(steps)}), NAMES.catalog)
    assert ["separate vessel" in item.step.text for item in followed[:5]] == [False, False, True, True, False]
    added = next(item for item in followed if "made aside" in item.step.text)
    assert {"Aniline", "Triethylamine", "BenzoylChloride"} <= set(added.contents)


def test_every_unread_span_is_named() -> None:
    read = read_procedure("The cake was kept. 467 g of copper sulfate, 780 ml; the rest. Water (5 mL) was added.")
    assert read.unread
    lacks = prepared(read)[2]
    assert all(any(repr(item.text) in line for line in lacks) for item in read.unread)


def test_a_wish_in_one_sentence_is_no_procedure() -> None:
    assert not is_procedure("Reduce benzophenone (3.64 g) with NaBH4 (0.4 g) in methanol (30 mL) at 0 °C for 30 min")
    assert is_procedure(REDUCTION)


@pytest.mark.parametrize(
    "text",
    [
        "Sodium azide (5 g) was dissolved in water (50 mL). Hydrochloric acid (10 mL) was added and the gas collected.",
        "Toluene (5 g) was added to nitric acid (15 mL). After stirring for 1 h trinitrotoluene (3 g) was isolated.",
        "Heat sodium hydride (1 g) in DMF (40 mL) at 90 C. Benzyl bromide (5 g) was added at 22 °C.",
    ],
)
def test_a_dangerous_procedure_is_refused_even_as_a_partial_one(text: str) -> None:
    with pytest.raises(LabgymError):
        compile_procedure(text, partial=True, names=NAMES)


def test_a_substance_that_no_action_owns_is_there_from_its_sentence_on() -> None:
    # The hydride is unread, and dimethylformamide is hot in the same sentence.
    hot = "Heat sodium hydride (1 g) in DMF (40 mL) at 90 C, then add methyl iodide (5 g) and phenol (3 g)."
    with pytest.raises(LabgymError):
        compile_procedure(hot, partial=True, names=NAMES)
