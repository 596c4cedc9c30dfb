"""The experiment library: complete, consistent, balanced, and within what the catalogue can do."""

from __future__ import annotations

from collections import Counter
from typing import Any, get_args

import pytest
from every_case import for_each

from labgym.assets import Catalog
from labgym.errors import UnknownNameError
from labgym.protocols import protocols
from labgym.protocols.experiments import Experiment, experiments, get
from labgym.protocols.experiments.checks import check
from labgym.protocols.experiments.feasibility import FeasibilityFilter, reasons
from labgym.protocols.model import ReactionType

LIBRARY = experiments()


def formula(smiles: str) -> tuple[Counter[str], int]:
    """Return how many atoms of each element a side of an equation has, and its charge."""
    chem = pytest.importorskip("rdkit.Chem")
    atoms: Counter[str] = Counter()
    charge = 0
    for part in smiles.split(".") if smiles else []:
        molecule = chem.MolFromSmiles(part)
        assert molecule is not None, part
        atoms.update(atom.GetSymbol() for atom in chem.AddHs(molecule).GetAtoms())
        charge += chem.GetFormalCharge(molecule)
    return atoms, charge


def canonical(smiles: str) -> Any:
    chem = pytest.importorskip("rdkit.Chem")
    return chem.CanonSmiles(smiles)


def test_the_library_covers_the_seven_types() -> None:
    counts = Counter(experiment.reaction_type for experiment in LIBRARY.values())
    assert len(LIBRARY) >= 150
    assert set(counts) == set(get_args(ReactionType))
    assert min(counts.values()) >= 20


def test_no_two_entries_tell_the_same() -> None:
    for what in ("name", "description"):
        assert len({getattr(experiment, what) for experiment in LIBRARY.values()}) == len(LIBRARY)
    assert not set(LIBRARY) & set(protocols())


@for_each("name", sorted(LIBRARY))
def test_every_entry_is_complete_and_its_amounts_agree(name: str) -> None:
    assert check(LIBRARY[name], Catalog.published()) == []


@for_each("name", sorted(LIBRARY))
def test_every_equation_balances_in_atoms_and_charge(name: str) -> None:
    left, _, right = LIBRARY[name].reaction.split(">")
    assert formula(left) == formula(right)


@for_each("name", sorted(LIBRARY))
def test_structures_agree_with_the_catalogue_and_the_equation(name: str) -> None:
    experiment = LIBRARY[name]
    catalog = Catalog.published()
    left, agents, _ = experiment.reaction.split(">")
    parts = Counter(canonical(part) for part in f"{left}.{agents}".split(".") if part)
    for material in experiment.materials:
        if material.name in catalog:
            chemistry = catalog.get(material.name).chemistry
            assert chemistry is not None
            assert material.smiles == (chemistry.smiles or "")
        if material.role == "reactant" and material.smiles:
            # The water of a hydrate or a solution takes no part.
            for part in material.smiles.removesuffix(".O").removesuffix(".O").split("."):
                assert canonical(part) in parts, f"{material.name} is a reactant and not in the equation"


def test_most_of_the_library_can_be_done_and_the_rest_lacks_a_reagent() -> None:
    feasibility = FeasibilityFilter(Catalog.published())
    verdicts = [feasibility.judge(experiment) for experiment in LIBRARY.values()]
    assert sum(verdict.feasible for verdict in verdicts) >= 150
    assert set(reasons(verdicts)) == {"unlisted"}


def test_what_is_feasible_keeps_its_names() -> None:
    feasibility = FeasibilityFilter(Catalog.published())
    for experiment in LIBRARY.values():
        assert feasibility.judge(experiment).experiment == experiment


def test_an_unknown_id_lists_what_is_near() -> None:
    assert isinstance(get(next(iter(LIBRARY))), Experiment)
    with pytest.raises(UnknownNameError, match="cyc_biginelli"):
        get("cyc_biginely")
