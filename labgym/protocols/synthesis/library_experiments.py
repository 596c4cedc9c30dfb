"""Protocols from the library of experiments, for reactions that are named in a text and have no template."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

from labgym.errors import LabgymError
from labgym.protocols.amounts import moles_of
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments import Experiment, experiments
from labgym.protocols.synthesis.batch import scaled
from labgym.protocols.synthesis.fidelity import unkept
from labgym.protocols.synthesis.staging import stage
from labgym.protocols.synthesis.writer import Commission, WriterResult


def from_library(commission: Commission, name: str) -> WriterResult:
    """Return the first experiment of a named reaction that keeps every statement of the text, as a protocol.

    Args:
        name: name of the reaction as written: "Swern".

    Raises:
        RefusalError: the library has no such experiment, or those that it has differ from the text; names them.
    """
    differences: list[str] = []
    for experiment in _experiments_of(name):
        try:
            protocol = stage(_scaled(experiment, commission), commission.catalog)
        except LabgymError:
            continue
        lost = tuple(dict.fromkeys(unkept(commission.description, protocol, commission.catalog)))
        if not lost:
            digest = hashlib.sha256(commission.text.encode()).hexdigest()[:10]
            text = f"{protocol.description} Chosen for the text: {commission.text[:1000]}"
            chosen = protocol.model_copy(update={"id": f"{protocol.id[:53]}-{digest}", "description": text})
            note = f"staged from the experiment {experiment.id} of the library: {experiment.name}"
            return WriterResult(chosen, (note, "its amounts and conditions are those of the library"))
        differences.append(f"{experiment.id} ({experiment.name}), which has no {' or '.join(map(repr, lost[:3]))}")
    if differences:
        message = f"there is no template for {name!r}; the library has {'; '.join(differences[:2])}"
        raise RefusalError("no-reaction", f"{message}: take it as it is with labgym protocols stage")
    raise RefusalError("no-reaction", f"neither a template nor an experiment exists for a reaction called {name!r}")


def _scaled(experiment: Experiment, commission: Commission) -> Experiment:
    """Return an experiment at the size that the text's first amount of one of its reagents gives it."""
    amounts = {portion.name: portion.amount for action in experiment.actions for portion in action.takes}
    for clause in commission.description.clauses:
        for name, amount in clause.amounts.items():
            if name not in amounts or name not in commission.catalog:
                continue
            asset = commission.catalog.get(name)
            ours, theirs = moles_of(asset, amount), moles_of(asset, amounts[name])
            if ours and theirs:
                return _resized(experiment, ours / theirs)
    return experiment


def _resized(experiment: Experiment, factor: float) -> Experiment:
    actions = [
        action.model_copy(
            update={
                "takes": tuple(
                    portion.model_copy(update={"amount": scaled(portion.amount, factor)}) for portion in action.takes
                )
            }
        )
        for action in experiment.actions
    ]
    return experiment.model_copy(update={"actions": tuple(actions)})


def _experiments_of(name: str) -> Iterator[Experiment]:
    word = name.lower().split()[0]
    for experiment in experiments().values():
        names = " ".join((experiment.id, experiment.name, *experiment.synonyms)).lower()
        if word in names or name.lower() in names:
            yield experiment
