"""Splits of floors: disjoint seeds, populations in turn, protocols by area, the same bytes again."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from labgym.errors import InfeasibleError, OptionError, UnknownNameError
from labgym.layouts import places, splits
from labgym.layouts.floors import SPLITS
from labgym.layouts.places import ATTEMPTS, CLUTTER, FIRST_SEEDS, PLACES, furnished, layout_at, place_at
from labgym.protocols import protocols


def test_populations_take_turns():
    for split in FIRST_SEEDS:
        places = [place_at(split, index, first=0) for index in range(6)]
        assert [place.population for place in places] == [*SPLITS[split], *SPLITS[split]]
        assert [place.index for place in places] == list(range(6))


def test_the_seeds_of_splits_published_rooms_and_development_are_disjoint():
    spans = [(first, first + (ATTEMPTS + 1) * PLACES) for first in FIRST_SEEDS.values()]
    published = [entry.seed for split in ("val", "test") for entry in splits.manifest(split).layouts]
    assert all(low > max(published) for low, _ in spans)
    for low, high in spans:
        assert all(low == other or high <= other or low >= end for other, end in spans)
    for split, first in FIRST_SEEDS.items():
        assert place_at(split, 7).seed == first + 7
        assert place_at(split, 7, attempt=2).seed == first + 7 + 2 * PLACES
    assert place_at("floors-test", 7, first=100).seed == 107


def test_seen_and_train_have_the_same_families_and_other_floors():
    assert SPLITS["floors-seen"] == SPLITS["floors-train"]
    assert place_at("floors-seen", 0).floor.floor != place_at("floors-train", 0).floor.floor


def test_larger_floors_have_more_protocols_and_levels_of_clutter_have_the_stated_shares():
    places = [place_at("floors-test", index, first=0) for index in range(36)]
    for place in places:
        most = min(5, 1 + int(place.floor.parameters["area"] / 50.0))
        assert max(1, most - 1) <= len(place.protocols) <= most
        assert len(set(place.protocols)) == len(place.protocols)
        assert all(protocols()[name].moves for name in place.protocols)
    assert {len(place.protocols) for place in places} >= {2, 3, 4, 5}
    counts = Counter(place.clutter for place in places)
    shares = np.array(CLUTTER["floors-test"]) / sum(CLUTTER["floors-test"])
    for level, share in enumerate(shares):
        assert counts[level] / 36 == pytest.approx(share, abs=4.0 * np.sqrt(share * (1.0 - share) / 36))


def test_a_place_gives_the_same_layout_again_and_clutter_only_adds():
    place, tidy, _ = furnished("floors-train", 1, first=0)
    layout = layout_at("floors-train", 1, first=0)
    assert place.clutter > 0
    assert layout.hash == place.cluttered(tidy).hash
    first = layout.placements[: len(tidy.placements)]
    assert [(p.id, p.position, p.yaw) for p in first] == [(p.id, p.position, p.yaw) for p in tidy.placements]
    assert layout.provenance.options["family"] == place.population.family
    assert layout.provenance.options["clutter"] == place.clutter
    assert "place" not in layout.provenance.options
    assert [protocol.id for protocol in layout.protocols] == list(place.protocols)


def test_training_floors_do_not_follow_the_default_rule_set():
    # The rule set touchstone gives another layout at this place.
    assert layout_at("floors-train", 2).hash.startswith("0e84435046")


def test_a_floor_can_be_published_and_made_again_from_its_place(tmp_path):
    layout = layout_at("floors-train", 0)
    written = splits.publish("floors-train", [layout], tmp_path)
    (entry,) = written.layouts
    assert (entry.room, entry.place, entry.seed) == (layout.floor.name, "floors-train/0", FIRST_SEEDS["floors-train"])
    assert splits.make_again(entry).hash == entry.hash
    assert splits.Manifest.load(tmp_path / "floors-train" / "manifest.json") == written


def test_the_next_seed_is_taken_where_a_floor_does_not_hold_its_protocols(monkeypatch):
    tidy = object()
    monkeypatch.setattr(places.SplitPlace, "check", lambda place, layout: None)
    monkeypatch.setattr(places.SplitPlace, "cluttered", lambda place, layout: layout)
    monkeypatch.setattr(places.SplitPlace, "tidy", lambda place: tidy if place.seed > 3 * PLACES else _fail())
    place, layout, _ = furnished("floors-train", 5, first=0)
    assert (place.seed, layout) == (5 + 3 * PLACES, tidy)
    monkeypatch.setattr(places.SplitPlace, "tidy", lambda place: _fail())
    with pytest.raises(InfeasibleError):
        furnished("floors-train", 5, first=0)


def test_a_floor_that_breaks_a_rule_of_one_of_its_protocols_takes_its_next_seed(monkeypatch):
    place, tidy, _ = furnished("floors-train", 3, first=0)
    monkeypatch.setattr(
        places.SplitPlace, "tidy", lambda place: tidy if place.seed > PLACES else tidy.replace(placements=())
    )
    again, layout, _ = furnished("floors-train", 3, first=0)
    assert (again.seed, layout) == (place.seed % PLACES + PLACES, tidy)


def _fail():
    raise InfeasibleError("floor", ["too small"], None)


def test_what_is_no_place_is_refused_in_one_line():
    with pytest.raises(UnknownNameError, match="floors-seen"):
        place_at("validation", 0)
    for index in (-1, PLACES, 1.5):
        with pytest.raises(OptionError, match="index"):
            place_at("floors-test", index)
