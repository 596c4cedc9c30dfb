"""What names mean: the published table, databases, the parser, the record, and what none of them knows."""

from __future__ import annotations

import time

import pytest

from labgym.assets import Catalog
from labgym.assets.structures import canonical
from labgym.assets.substances import Substance, _table, is_generic, listed_name
from labgym.protocols import Protocol
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments import Action, Experiment, Material, Portion
from labgym.protocols.substances import Resolver, opened, sources
from labgym.protocols.substances.opening import forms
from labgym.protocols.synthesis.staging import stage

pytest.importorskip("rdkit")
CATALOG = Catalog.published()
OFFLINE = Resolver(CATALOG, databases=False, parser=False)


def meaning(name: str, smiles: str = "", resolver: Resolver = OFFLINE):
    return resolver.resolve([Material(name=name, role="reagent", smiles=smiles)])[0]


def test_the_table_names_assets_that_exist_structures_that_parse_and_hazards_that_hold() -> None:
    for entry in _table().entries:
        title = entry.names[0]
        assert not entry.asset or entry.asset in CATALOG, title
        if entry.traits is not None:
            fields = {name: getattr(entry.traits, name) for name in type(entry.traits).model_fields}
            assert Substance(name="Listed", names=(title,), source="table", **fields).is_classified
        if entry.smiles:
            canonical(entry.smiles)
        for name in entry.names:
            match = CATALOG.match(name) if entry.asset else None
            assert match is None or match.name == entry.asset, f"{name}: {match}"
            assert not is_generic(name), name


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("petroleum ether", "PetroleumEther"),
        ("light petroleum", "PetroleumEther"),
        ("Celite 521", "Celite"),
        ("Hyflo", "Celite"),
        ("hexanes", "NHexane"),
        ("saturated brine", "SodiumChloride"),
        ("ice water", "DeionizedWater"),
        ("industrial methylated spirits", "Ethanol"),
        ("DCCI", "Dicyclohexylcarbodiimide"),
        ("anhydrous sodium sulphate", "SodiumSulfate"),
    ],
)
def test_traps_are_assets_of_the_catalog(name, expected) -> None:
    assert meaning(name).asset == expected


@pytest.mark.parametrize(
    ("name", "smiles"),
    [
        ("HATU", "F[P-](F)(F)(F)(F)F.CN(C)C(=[N+](C)C)On1nnc2cccnc12"),
        ("1 M LiHMDS", "[Li+].C[Si](C)(C)[N-][Si](C)(C)C"),
        ("dry DMA", "CC(=O)N(C)C"),
        ("Lawesson's reagent", "COc1ccc(cc1)P1(=S)SP(=S)(S1)c1ccc(OC)cc1"),
        ("HCl in dioxane", "Cl"),
    ],
)
def test_abbreviations_have_the_structures_of_the_table(name, smiles) -> None:
    known = meaning(name)
    structure = CATALOG.get(known.asset).chemistry.smiles if known.asset else known.smiles
    assert canonical(structure) == canonical(smiles)


@pytest.mark.parametrize(
    "name",
    ["crude product", "compound 12a", "(iv)", "the title compound", "hydrochloride", "5", "33.7", "ester", "14(a)"],
)
def test_words_that_name_no_substance_are_not_looked_up(name) -> None:
    assert list(forms(name)) == []
    assert not meaning(name).is_known
    assert meaning(name, "CCCCCCCCCCN").smiles == "CCCCCCCCCCN"  # the record still says what it is


def test_a_mixture_of_solvents_is_its_parts_with_shares_of_the_volume() -> None:
    assert meaning("ethyl acetate/hexane (1:3)").parts == (("EthylAcetate", 0.25), ("NHexane", 0.75))
    assert meaning("ethanol pentane").parts == (("Ethanol", 0.5), ("NPentane", 0.5))
    assert meaning("sodium chloride water").parts == ()
    eluent = Action(verb="Chromatograph", takes=(Portion(name="EtOAc-heptane (1:3)", amount="400 mL"),))
    result = opened(experiment(eluent), OFFLINE).experiment
    assert [(p.name, p.amount) for p in result.actions[-1].takes] == [
        ("EthylAcetate", "100 mL"),
        ("NHeptane", "300 mL"),
    ]


def test_two_structures_for_one_name_lower_the_confidence(monkeypatch) -> None:
    from labgym.protocols.substances import opening

    monkeypatch.setattr(opening, "database_structures", lambda names: {"ambiguol": "CCCCCCCCCCCCO"})
    monkeypatch.setattr(opening, "parsed_structures", lambda names: {"ambiguol": "CCCCCCCCCCCCN"})
    both = Resolver(CATALOG)
    assert meaning("ambiguol", resolver=both).is_disputed
    assert meaning("ambiguol", resolver=both).source == "chemicals"
    # Two sources outvote one.
    assert meaning("ambiguol", "CCCCCCCCCCCCN", both).smiles == "CCCCCCCCCCCCN"
    used = experiment(Action(verb="Add", takes=(Portion(name="ambiguol", amount="1.0 g"),)))
    substance = next(item for item in opened(used, both).substances if item.names == ("ambiguol",))
    assert substance.confidence == "low"
    assert "base" in substance.flags  # of the rival structure
    assert "opsin reads it as" in substance.notes


def experiment(*actions: Action) -> Experiment:
    start = (
        Action(verb="Add", takes=(Portion(name="benzoic acid", amount="1.2 g, 10 mmol"),)),
        Action(verb="Add", takes=(Portion(name="DMA", amount="20 mL"),)),
        Action(verb="Stir", duration=60.0),
    )
    names = dict.fromkeys(portion.name for action in (*start, *actions) for portion in action.takes)
    materials = tuple(Material(name=name, role="solvent" if name == "DMA" else "reactant") for name in names)
    return Experiment(id="open", name="an amide", product="an amide", materials=materials, actions=(*start, *actions))


def test_an_experiment_with_unknown_materials_becomes_a_partial_protocol_that_reloads() -> None:
    strange = Action(verb="Add", takes=(Portion(name="compound 7", amount="2.0 g"),))
    protocol = stage(experiment(strange, Action(verb="Stir", duration=30.0)), names=OFFLINE)
    assert {substance.names[0] for substance in protocol.substances} == {"DMA", "compound 7"}
    assert any("compound 7" in line for line in protocol.partial)
    assert protocol.reaction_type is None
    assert Protocol.parse(protocol.to_json()) == protocol
    known = stage(experiment(), names=OFFLINE)
    assert known.partial == ()
    (solvent,) = known.substances
    assert (solvent.smiles, solvent.state) == ("CC(=O)N(C)C", "liquid")


def test_what_ignites_in_air_is_added_under_nitrogen_which_is_said_to_be_assumed() -> None:
    amounts = {"anisole": "1.1 g, 10 mmol", "THF": "20 mL", "n-BuLi": "4.0 mL"}
    adds = [Action(verb="Add", takes=(Portion(name=name, amount=amount),)) for name, amount in amounts.items()]
    adds[-1] = adds[-1].model_copy(update={"temperature": -70.0})
    stirred = Action(verb="Stir", temperature=-70.0, duration=30.0)
    materials = tuple(Material(name=name, role="solvent" if name == "THF" else "reactant") for name in amounts)
    used = Experiment(id="metal", name="a salt", product="a salt", materials=materials, actions=(*adds, stirred))
    protocol = stage(used, names=OFFLINE, partial=("the end of the text",))
    assert protocol.partial == ("the end of the text",)
    (step,) = [step for step in protocol.steps if "NButyllithium" in step.uses and step.action == "Add"]
    assert "SchlenkLine" in step.uses
    assert "nitrogen is assumed" in step.text


@pytest.mark.parametrize("smiles", ["O=C(Cl)Cl", "C=[N+]=[N-]", "CP(=O)(F)OC(C)C"])
def test_a_grave_reagent_is_refused_by_its_structure(smiles) -> None:
    used = experiment(Action(verb="Add", takes=(Portion(name="reagent Q", amount="1.0 g"),)))
    materials = tuple(m.model_copy(update={"smiles": smiles}) if m.name == "reagent Q" else m for m in used.materials)
    with pytest.raises(RefusalError):
        stage(used.model_copy(update={"materials": materials}), names=OFFLINE)


def test_a_mass_below_the_balance_names_a_stock_solution_and_a_larger_batch() -> None:
    tiny = experiment(Action(verb="Add", takes=(Portion(name="DMAP", amount="0.9 mg"),)), Action(verb="Stir"))
    with pytest.raises(RefusalError, match=r"0\.9 mg of .* stock solution .* times the batch"):
        stage(tiny, names=OFFLINE)


@pytest.mark.parametrize(
    "text", ["(" * 5000, "aqueous " * 2000, "a/" * 3000, "1 " * 4000, "saturated\n" * 900, "é" * 200]
)
def test_hostile_names_take_linear_time(text) -> None:
    start = time.process_time()
    for name in (text[:200], text[:400], text):
        list(forms(name))
        OFFLINE._mixture(name)
        listed_name(name)
    assert time.process_time() - start < 2.0


def test_the_database_knows_systematic_names_and_measured_data() -> None:
    pytest.importorskip("chemicals")
    assert meaning("4-bromoaniline", resolver=Resolver(CATALOG, parser=False)).smiles == canonical("Nc1ccc(Br)cc1")
    data = sources.physical_data("Nc1ccc(Br)cc1")
    assert data.state == "solid"  # melts at 66 C
    liquid = sources.physical_data("CCCCCCO")  # 1-hexanol: 0.814 g/mL, 157 C
    assert liquid.state == "liquid"
    assert liquid.density == pytest.approx(0.814, abs=0.01)
    assert liquid.boiling_point == pytest.approx(157.0, abs=2.0)


def test_the_parser_reads_names_that_no_table_has_in_one_call() -> None:
    if not sources.available()["opsin"]:
        pytest.skip("py2opsin or a Java runtime is not installed")
    names = ["2-(4-bromophenyl)-5-methylhexan-3-ol", "ethane sulfonyl chloride", "no such name"]
    parsed = sources.parsed_structures(names)
    assert canonical(parsed[names[0]]) == canonical("CC(c1ccc(Br)cc1)C(O)CC(C)C")
    assert set(parsed) == {names[0]}  # two substances are not one


@pytest.mark.parametrize(
    ("misprint", "name"),
    [
        ("tetrabutylammonium flouride", "tetrabutylammonium fluoride"),
        ("2-(pyrroldin-1-yl)ethanol", "2-(pyrrolidin-1-yl)ethanol"),
        ("N,N1 -dicyclohexylcarbodiimide", "N,N'-dicyclohexylcarbodiimide"),
        ("sodium triacetoxy boron hydride", "sodium triacetoxy borohydride"),
    ],
)
def test_a_misprint_of_one_letter_is_read_after_the_name_as_written(misprint: str, name: str) -> None:
    assert list(forms(misprint))[:2] == [misprint, name]
    assert next(forms(name)) == name
