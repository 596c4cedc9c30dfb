"""The published protocols: thirty, sound, complete, and of the size that the paper's table 1 states."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from every_case import for_each

from labgym.assets import Catalog
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.layouts.places import published_protocols
from labgym.protocols import Protocol, check, derive, get, protocols, resolve, statistics, validate

LIBRARY = protocols()
each = for_each("protocol", LIBRARY.values())
CATALOG = Catalog.load()


def test_there_are_thirty_over_the_seven_reaction_types():
    assert len(LIBRARY) == 30
    counts: dict[str, int] = {}
    for protocol in LIBRARY.values():
        counts[protocol.reaction_type] = counts.get(protocol.reaction_type, 0) + 1
    assert len(counts) == 7
    assert set(counts.values()) == {4, 5}


@pytest.mark.parametrize(
    ("field", "mean", "least", "most", "deviation"),
    [
        ("reagents", 5.27, 3, 9, 1.86),
        ("instruments", 9.87, 7, 14, 1.81),
        ("steps", 9.00, 6, 11, 1.46),
        ("moves", 4.30, 3, 6, 1.15),
    ],
)
def test_statistics_as_published_are_those_of_the_papers_table_1(field, mean, least, most, deviation):
    summary = getattr(statistics(published_protocols().values()), field)
    assert summary.mean == pytest.approx(mean, rel=0.05)
    assert summary.deviation == pytest.approx(deviation, rel=0.05)
    assert least <= summary.minimum <= summary.maximum <= most


@pytest.mark.parametrize(
    ("field", "mean", "least", "most"),
    [("reagents", 5.30, 3, 9), ("instruments", 10.77, 7, 14), ("steps", 9.00, 6, 11), ("moves", 4.30, 3, 6)],
)
def test_statistics_of_the_corrected_library_are_those_that_the_documentation_states(field, mean, least, most):
    summary = getattr(statistics(LIBRARY.values()), field)
    assert round(summary.mean, 2) == mean
    assert (summary.minimum, summary.maximum) == (least, most)


def test_statistics_are_the_textbook_formulas():
    chosen = [LIBRARY["sub_01"], LIBRARY["alk_03"], LIBRARY["pro_05"]]
    counts = [len(protocol.steps) for protocol in chosen]
    mean = sum(counts) / 3
    summary = statistics(chosen).steps
    assert summary.mean == pytest.approx(mean)
    assert summary.deviation == pytest.approx(math.sqrt(sum((count - mean) ** 2 for count in counts) / 2))
    assert (summary.minimum, summary.maximum) == (min(counts), max(counts))
    assert statistics(chosen[:1]).steps.deviation == 0.0


def test_statistics_of_nothing_are_refused():
    with pytest.raises(OptionError):
        statistics([])


@each
def test_each_protocol_passes_the_validation_suite(protocol):
    assert validate(protocol) == ()
    assert check(protocol) is protocol


@each
def test_each_protocol_has_names_to_be_found_by(protocol):
    assert len(protocol.description) > 60
    assert len(protocol.synonyms) >= 5
    assert any(ord(char) > 0x4E00 for synonym in protocol.synonyms for char in synonym)
    assert protocol.reaction.count(">") == 2


def test_descriptions_and_synonym_lists_differ():
    assert len({protocol.description for protocol in LIBRARY.values()}) == 30
    assert len({protocol.synonyms for protocol in LIBRARY.values()}) == 30


@each
def test_steps_use_what_their_text_names(protocol):
    """A reagent that a step's text names is used there, unless it waits in its bottle or is what must go."""
    waiting = ("stage", "carry", "no ", "residue", "waste", "smell", "layer", "to remove")
    for step in protocol.steps:
        for use in protocol.reagents:
            common = CATALOG.get(use.name).synonyms_en[0].lower()
            if common in step.text.lower() and not any(word in step.text.lower() for word in waiting):
                assert use.name in step.uses or step.action in ("Concentrate", "Clean", "Analyze"), (step.text, common)


@each
def test_analysis_instruments_are_used_where_products_are_analysed(protocol):
    for step in protocol.steps:
        for name in step.uses:
            if CATALOG.get(name).category == "analytical" and name not in ("PHPaper", "UVCabinet"):
                assert step.location == "ValidationPlatform"
            if name == "RotaryEvaporator":
                assert step.location == "RotaryEvaporatorStation"
            if name in ("DryingOven", "VacuumOven"):
                assert step.location == "DryingStation"


@each
def test_the_committed_constraints_are_those_that_follow_from_the_content(protocol):
    assert derive(protocol) == protocol


@each
def test_the_route_visits_the_steps_locations_in_order(protocol):
    visited = [step.location for step in protocol.steps]
    stops = [place for place, before in zip(visited, [None, *visited], strict=False) if place != before]
    assert list(protocol.route) == stops
    assert protocol.moves == len(stops) - 1
    assert set(protocol.locations) == set(visited)


@each
def test_required_assets_are_reagents_instruments_and_locations(protocol):
    required = protocol.required_assets()
    assert len(required) == len(protocol.reagents) + len(protocol.instruments) + len(set(protocol.route))
    assert all(name in CATALOG for name in required)


@pytest.mark.parametrize("given", ["sub_99", "", "SUB_01", None, 3, "../sub_01"])
def test_an_unknown_id_names_those_that_exist(given):
    with pytest.raises(UnknownNameError, match="sub_01"):
        get(given)


def test_what_a_caller_does_to_the_library_does_not_last():
    protocols().clear()
    assert len(protocols()) == 30
    assert get("sub_01") is protocols()["sub_01"]


@each
def test_a_protocol_survives_saving_and_loading(protocol, tmp_path):
    assert Protocol.load(protocol.save(tmp_path / "copy.json")) == protocol


@pytest.mark.parametrize("text", ["Stir benzophenone in EtOAc/hexane for 1 h", "Stir it with a spoon. " * 40])
def test_a_description_in_place_of_a_protocol_is_recognized(text):
    with pytest.raises(UnknownNameError, match="labgym protocols new TEXT"):
        resolve(text)


def test_a_file_of_another_format_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text("id: mine")
    with pytest.raises(UnknownNameError, match=r"mine\.yaml is a file, but protocols are \.json files"):
        resolve("mine.yaml")


def test_a_protocol_is_resolved_from_itself_its_id_and_its_file(tmp_path):
    protocol = LIBRARY["sub_01"].model_copy(update={"id": "mine"})
    file = protocol.save(tmp_path / "mine.json")
    assert resolve(protocol) is protocol
    assert resolve("sub_01") == LIBRARY["sub_01"]
    assert resolve(file) == resolve(str(file)) == protocol


@pytest.mark.parametrize("name", ["sub_99", "", 7])
def test_a_name_that_is_no_protocol_is_refused_with_what_would_be_right(name):
    with pytest.raises(UnknownNameError, match=r"an id or a \.json file.*available: alk_01"):
        resolve(name)


@pytest.mark.parametrize("path", ["nowhere.json", "folder/sub_01", Path("sub_01")])
def test_a_path_is_read_as_a_file_even_where_a_protocol_has_its_name(path):
    with pytest.raises(DocumentError, match="no such file"):
        resolve(path)
