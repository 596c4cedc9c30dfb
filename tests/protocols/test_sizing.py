"""Sizes of vessels and machines: the smallest that fits, portions beyond the largest, the same layouts as before."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest

from labgym.assets import Asset, Catalog
from labgym.layouts import generate
from labgym.protocols import examine
from labgym.protocols.amounts import scaled
from labgym.protocols.apparatus import vessel_for
from labgym.protocols.contents import situations
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments import Experiment, experiments
from labgym.protocols.portions import portions
from labgym.protocols.synthesis.staging import stage

CATALOG = Catalog.published()


def at_scale(name: str, factor: float) -> Experiment:
    experiment = experiments()[name]
    actions: list[Any] = []
    for action in experiment.actions:
        takes = tuple(use.model_copy(update={"amount": scaled(use.amount, factor)}) for use in action.takes)
        actions.append(action.model_copy(update={"takes": takes}))
    return experiment.model_copy(update={"actions": tuple(actions)})


def milliliters(vessel: Asset) -> float:
    assert vessel.specs.capacity_mL is not None
    return vessel.specs.capacity_mL


@pytest.mark.parametrize(
    ("volume", "vessel"),
    [
        (6.0, "RoundBottomFlask10"),
        (6.1, "RoundBottomFlask50"),
        (150.0, "RoundBottomFlask"),
        (600.0, "RoundBottomFlask1000"),
        (601.0, "ThreeNeckFlask2000"),
        (3000.0, "ThreeNeckFlask5000"),
        (3001.0, "JacketedReactor10000"),
        (12000.0, "JacketedReactor20000"),
    ],
)
def test_a_mixture_fills_the_smallest_vessel_to_at_most_sixty_percent(volume: float, vessel: str) -> None:
    assert vessel_for(volume, CATALOG) == vessel


def test_a_mixture_that_no_vessel_takes_is_refused() -> None:
    with pytest.raises(RefusalError, match=r"12\.1 L is too large"):
        vessel_for(12100.0, CATALOG)


@pytest.mark.parametrize("factor", [0.01, 1.0, 10.0])
@pytest.mark.parametrize("name", ["red_benzaldehyde_swern", "cyc_phenylmaleimide", "con_cinnamic_acid_perkin"])
def test_a_protocol_has_no_faults_at_any_scale(name: str, factor: float) -> None:
    protocol = stage(at_scale(name, factor))
    assert [finding for finding in examine(protocol) if finding.severity == "fault"] == []
    for situation in situations(protocol, CATALOG):
        if situation.vessel is not None:
            assert situation.volume / portions(situation.step) <= milliliters(situation.vessel)


def test_a_larger_batch_has_heavier_glassware() -> None:
    masses = []
    for factor in (0.01, 1.0, 10.0):
        instruments = [CATALOG.get(name) for name in stage(at_scale("red_benzaldehyde_swern", factor)).instruments]
        masses.append(sum(asset.mass for asset in instruments if asset.category == "glassware"))
    assert masses == sorted(set(masses))


def test_a_step_that_overfills_its_flask_says_into_which_the_batch_is_transferred() -> None:
    protocol = stage(at_scale("cyc_phenyl_methylpyrazolone", 18.0))
    evaporation = next(step for step in protocol.steps if step.action == "Concentrate")
    trituration = next(step for step in protocol.steps if step.action == "Triturate")
    assert "RoundBottomFlask1000" in evaporation.uses
    assert "ThreeNeckFlask2000" in trituration.uses
    assert "transfer the batch to a flask of 2000 mL" in trituration.text


def test_what_is_higher_than_a_hood_stands_in_a_walk_in_hood() -> None:
    headroom = CATALOG.get("FumeHood").surfaces[0].headroom
    assert headroom is not None
    protocol = stage(at_scale("red_benzaldehyde_swern", 90.0))
    reactor = next(CATALOG.get(name) for name in protocol.instruments if name.startswith("JacketedReactor"))
    assert reactor.size.height > headroom
    assert {step.location for step in protocol.steps if reactor.name in step.uses} == {"WalkInFumeHood"}


def test_sizes_of_a_vessel_hold_their_volume_and_grow_with_it() -> None:
    for name in {asset.family for asset in CATALOG if asset.size_of is not None}:
        sizes = [size for size in CATALOG.sizes(name) if size.specs.capacity_mL is not None]
        volumes = [milliliters(size) for size in sizes]
        assert volumes == sorted(volumes), name
        for small, large in pairwise(sizes):
            assert small.size.height <= large.size.height
            assert small.mass < large.mass
        for size in sizes:
            liters = 1000.0 * math.pi / 4.0 * size.size.width * size.size.depth * size.size.height
            assert liters > milliliters(size) / 1000.0 or size.subtype in ("mantle", "pipette"), size.name


def test_a_catalog_without_sizes_gives_the_same_layout() -> None:
    without = Catalog([asset for asset in CATALOG if asset.size_of is None or asset.core])
    assert len(without) < len(CATALOG) - 40
    assert generate("alk_01", 3).hash == generate("alk_01", 3, catalog=without).hash


def test_amounts_of_several_steps_count_in_their_order_and_an_aqueous_layer_keeps_no_ether() -> None:
    perkin = situations(stage(experiments()["con_cinnamic_acid_perkin"]), CATALOG)
    extraction = next(k for k, situation in enumerate(perkin) if situation.step.action == "Extract")
    assert perkin[extraction].contents["DiethylEther"] == 30.0
    assert "DiethylEther" not in perkin[extraction + 1].contents
    pyrazolone = situations(stage(experiments()["cyc_phenyl_methylpyrazolone"]), CATALOG)
    ethanol = {situation.step.action: situation.contents.get("Ethanol", 0.0) for situation in pyrazolone}
    assert (ethanol["Reflux"], ethanol["Recrystallize"]) == (20.0, 40.0)
