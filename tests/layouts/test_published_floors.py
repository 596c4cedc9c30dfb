"""The published splits of floors: every file and hash, families, drives, and what made them."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import get_args

import gymnasium as gym
import numpy as np
import pytest

from labgym.artefacts import artefacts
from labgym.cli.reproduction import PublishedSplit
from labgym.cli.splits import SplitName
from labgym.envs.tasks import SPLITS as ENVIRONMENT_SPLITS
from labgym.envs.training import training_floor
from labgym.errors import OptionError, UnknownNameError
from labgym.eval.publication import COUNTS, faults
from labgym.layouts import load_published, published, splits
from labgym.layouts.floors import SPLITS
from labgym.layouts.generate import FURNISHER
from labgym.layouts.places import FIRST_SEEDS, PLACES
from labgym.layouts.rules import evaluate_layout
from labgym.layouts.rules.safety.rules import RULES
from labgym.layouts.sealed import SEALED_FLOORS, commitment
from labgym.navigation import ShortestPaths
from labgym.suites import load_suite


@pytest.mark.parametrize("split", COUNTS)
def test_a_split_has_its_families_in_turn_and_seeds_of_its_own(split):
    made = splits.manifest(split)
    assert len(made.layouts) == COUNTS[split]
    assert made.furnisher is not None
    folder = artefacts("layouts") / split
    assert {path.stem for path in folder.glob("*.json")} == {*published(split), "manifest"}
    for index, entry in enumerate(made.layouts):
        assert entry.id == f"{split}-{index:04d}"
        assert entry.place == f"{split}/{index}"
        assert entry.family == SPLITS[split][index % 3].family
        assert (entry.seed - FIRST_SEEDS[split] - index) % PLACES == 0
        assert entry.protocol == entry.protocols[0]


@pytest.mark.parametrize("split", COUNTS)
def test_every_file_has_its_hash_and_names_what_the_manifest_says(split):
    """20 ms of CPU a floor."""
    assert splits.mismatches(split) == ()
    for entry in splits.manifest(split).layouts:
        data = json.loads((artefacts("layouts") / split / f"{entry.id}.json").read_bytes())
        assert data["id"] == entry.id
        assert data["provenance"]["seed"] == entry.seed
        assert [protocol["id"] for protocol in data["protocols"]] == list(entry.protocols)


def test_no_two_published_floors_are_equal_and_test_floors_are_in_use():
    hashes = [entry.hash for split in COUNTS for entry in splits.manifest(split).layouts]
    assert len(set(hashes)) == len(hashes) == sum(COUNTS.values())
    levels = Counter(entry.clutter for entry in splits.manifest("floors-test").layouts)
    assert levels[0] == 0
    assert levels[3] > levels[2] > levels[1]


@pytest.mark.parametrize("split", COUNTS)
def test_the_suite_of_a_split_has_drives_on_each_of_its_floors(split):
    suite = load_suite(split)
    assert (suite.name, suite.split, suite.layouts) == (split, split, published(split))
    assert all(1 <= len(drives) <= 12 for drives in suite.drives.values())
    ends = {(name, drive.start, drive.goal) for name, drives in suite.drives.items() for drive in drives}
    assert len(ends) == sum(map(len, suite.drives.values()))
    assert all(math.dist(start[:2], goal[:2]) > 0.0 for _, start, goal in ends)


@pytest.mark.parametrize("split", COUNTS)
def test_published_floors_name_the_furnisher_that_made_them(split):
    """Furnisher 2 made them, under the safety rules, and makes the same floors again."""
    made = splits.manifest(split)
    assert made.furnisher == FURNISHER
    assert made.reproducible


def test_a_published_floor_and_its_drives_have_no_fault():
    layout = load_published("floors-test", published("floors-test")[1])
    suite = load_suite("floors-test")
    # The floor was published before `touchstone` had its safety rules: it breaks some of those, and nothing else.
    assert [fault for fault in faults(layout, suite.drives[layout.id]) if not fault.endswith("touchstone")] == []
    assessment = evaluate_layout(layout, layout.protocol, navigation=True, rules="touchstone")
    safety = {rule.name for rule in RULES}
    hard = {issue.rule for issue in assessment.issues if issue.severity == "error"}
    assert hard <= safety
    assert assessment.v == len(assessment.violations.of("facility", "missing"))
    paths = ShortestPaths(layout)
    assert all(paths.path(drive.start, drive.goal).length >= 2.0 - 1e-6 for drive in suite.drives[layout.id])


def test_the_environment_serves_published_floors_and_their_drives():
    assert set(splits.PUBLISHED) | {"train", "floors-train"} == set(ENVIRONMENT_SPLITS)
    env = gym.make("LabPointNav-v0", split="floors-seen")
    suite = load_suite("floors-seen")
    try:
        _, info = env.reset(seed=4)
        drives = suite.drives[info["layout"]]
        assert info["goal"] == pytest.approx(np.array(drives[info["pair"]].goal))
        assert info["pose"] == pytest.approx(np.array(drives[info["pair"]].start), abs=1e-3)
        _, info = env.reset(seed=4, options={"pair": 0})
        assert info["goal"] == pytest.approx(np.array(suite.drives[info["layout"]][0].goal))
        with pytest.raises(UnknownNameError, match="goal pair"):
            env.reset(seed=4, options={"pair": 1000})
    finally:
        env.close()


def test_floors_train_is_a_split_of_the_environment_and_brings_its_own_layouts():
    with pytest.raises(OptionError, match="floors-train"):
        gym.make("LabPointNav-v0", split="floors-train", training=training_floor)
    with pytest.raises(UnknownNameError, match="floors-train"):
        gym.make("LabPointNav-v0", split="floors-trian")


def test_the_sealed_split_is_committed_to():
    committed = commitment()
    assert committed is not None
    assert len(committed.floors) == SEALED_FLOORS
    assert len({floor.hash for floor in committed.floors}) == SEALED_FLOORS
    assert not (artefacts("layouts") / "floors-sealed" / "manifest.json").exists()


def test_commands_know_the_splits():
    assert set(get_args(SplitName)) == set(FIRST_SEEDS)
    assert get_args(PublishedSplit) == splits.PUBLISHED
