"""Protocols from the library of experiments, for reactions that are named in a text and have no template."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

from labgym.errors import LabgymError
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments import Experiment, experiments
from labgym.protocols.synthesis.fidelity import unkept
from labgym.protocols.synthesis.staging import stage
from labgym.protocols.synthesis.writer import Commission, WriterResult


def from_library(commission: Commission, name: str) -> WriterResult:
    """Return the first experiment of a named reaction that keeps every statement of the text, as a protocol.

    Args:
        name: of the reaction, as written: "Swern".

    Raises:
        RefusalError: the library has no such experiment, or those that it has differ from the text; names them.
    """
    differences: list[str] = []
    for experiment in _experiments_of(name):
        try:
            protocol = stage(experiment, commission.catalog)
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
    raise RefusalError("no-reaction", f"there is no template for a reaction called {name!r}, and no experiment")


def _experiments_of(name: str) -> Iterator[Experiment]:
    word = name.lower().split()[0]
    for experiment in experiments().values():
        names = " ".join((experiment.id, experiment.name, *experiment.synonyms)).lower()
        if word in names or name.lower() in names:
            yield experiment
