"""Protocols depend on the catalogue that is passed, and on no other."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.protocols import RefusalError, derive, examine, get, validate
from labgym.protocols.apparatus import APPARATUS
from labgym.protocols.experiments import experiments
from labgym.protocols.experiments.checks import check
from labgym.protocols.experiments.feasibility import FeasibilityFilter
from labgym.protocols.retrieval import search
from labgym.protocols.synthesis import read, synthesize
from labgym.protocols.synthesis.staging import stage

CATALOG = Catalog.published()
TEXT = "Reduce benzophenone (3.64 g, 20 mmol) with NaBH4 (0.8 g) in 40 mL methanol at 0 C for 30 min, quench with water"


def without(*names: str) -> Catalog:
    return Catalog([asset for asset in CATALOG if asset.name not in names])


@pytest.fixture
def no_default(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail where something looks up a catalogue by itself."""

    def lookup(*_: object) -> Catalog:
        raise AssertionError("the default catalogue is looked up below the boundary")

    monkeypatch.setattr(Catalog, "load", lookup)
    monkeypatch.setattr(Catalog, "published", lookup)


@pytest.mark.usefixtures("no_default")
def test_everything_works_with_the_catalogue_that_is_passed() -> None:
    protocol = synthesize(TEXT, keyword_only=True, catalog=CATALOG).protocol
    assert derive(protocol, CATALOG) == protocol
    assert not validate(protocol, CATALOG)
    assert not [finding for finding in examine(protocol, CATALOG) if finding.severity == "fault"]
    experiment = experiments()["cyc_biginelli"]
    assert FeasibilityFilter(CATALOG).judge(experiment).feasible
    assert not check(experiment, CATALOG)
    assert stage(experiment, CATALOG).steps
    assert search("TBAF", keyword_only=True, catalog=CATALOG).hits
    assert read(TEXT, CATALOG).clauses


def test_a_description_may_name_only_what_the_catalogue_holds() -> None:
    with pytest.raises(RefusalError):
        synthesize(TEXT, keyword_only=True, catalog=without("SodiumBorohydride"))


def test_a_protocol_is_checked_against_the_catalogue_that_is_passed() -> None:
    findings = validate(get("sub_01"), without("Acetone"))
    assert any(finding.rule == "asset-exists" and "'Acetone'" in finding.message for finding in findings)


def test_two_catalogues_do_not_share_a_search_index() -> None:
    assert any(m.name == "Acetone" for clause in read("Add acetone.", CATALOG).clauses for m in clause.mentions)
    smaller = read("Add acetone.", without("Acetone"))
    assert not any(m.name == "Acetone" for clause in smaller.clauses for m in clause.mentions)


@pytest.mark.parametrize("action", APPARATUS)
def test_the_apparatus_of_each_action_is_in_the_catalogue(action: str) -> None:
    apparatus = APPARATUS[action]
    names = [name for name in apparatus.fill() if name]
    assert {CATALOG.get(name).kind for name in names} <= {"instrument"}
    assert CATALOG.get(apparatus.place).kind == "facility"
    for choice in apparatus.needs:
        assert all(CATALOG.get(name).kind == "instrument" for name in choice if name in CATALOG)
    assert apparatus.minutes > 0.0


def test_slots_are_filled_in_the_order_of_the_table() -> None:
    distillation = APPARATUS["Distill"].fill(vessel=("RoundBottomFlask",), bath=("OilBath",), pump=("VacuumPump",))
    assert distillation[0] == "RoundBottomFlask"
    assert distillation[-2:] == ("VacuumPump", "OilBath")
    assert not any("{" in name for apparatus in APPARATUS.values() for name in apparatus.fill())
