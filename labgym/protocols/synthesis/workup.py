"""From the end of the reaction to the pure product: quench, work-up, purification."""

from __future__ import annotations

from collections.abc import Callable

from labgym.protocols.synthesis import isolation, purification, quench
from labgym.protocols.synthesis.phases import WorkUpStep
from labgym.protocols.synthesis.workup_writer import WorkUpWriter
from labgym.quantities import ROOM_TEMPERATURE


class WorkUp(WorkUpWriter):
    """Appends the steps of a work-up to a protocol."""

    def carry_out(self, step: WorkUpStep) -> None:
        """Append the protocol's steps for a step of the work-up; a hot mixture is left to cool first."""
        if self.hot and step.action != "Distill":
            text = f"Let the mixture cool to {ROOM_TEMPERATURE:g} C."
            self.builder.do("Cool", text, (), ROOM_TEMPERATURE, 20.0, vessel=(self.vessel,))
        self.hot = False
        if not step.text:
            self.assumed.append(_IN_WORDS.get(step.action, step.action.lower()))
        _STEPS[step.action](self, step)


_IN_WORDS = {
    "Acidify": "acidification",
    "Basify": "basification",
    "Concentrate": "evaporation",
    "Crystallize": "crystallization",
    "Dissolve": "dissolution of the residue",
    "DrySolid": "drying",
    "DrySolution": "drying of the organic layer",
    "DryVacuum": "drying under vacuum",
    "Distill": "distillation",
    "Chromatograph": "chromatography",
    "Recrystallize": "recrystallization",
    "Extract": "extraction",
    "Filter": "filtration",
    "PhaseSeparation": "separation of the layers",
    "Quench": "quench",
    "Wash": "wash",
}
_STEPS: dict[str, Callable[[WorkUpWriter, WorkUpStep], None]] = {
    "Quench": quench.quench,
    "Acidify": quench.quench,
    "Basify": quench.quench,
    "Dissolve": isolation.dissolve,
    "Extract": isolation.extract,
    "PhaseSeparation": isolation.separate,
    "Wash": isolation.wash,
    "DrySolution": isolation.dry_solution,
    "Filter": isolation.filter_off,
    "Concentrate": isolation.concentrate,
    "Recrystallize": purification.recrystallize,
    "Crystallize": purification.crystallize,
    "Distill": purification.distil,
    "Chromatograph": purification.chromatograph,
    "DrySolid": purification.dry_solid,
    "DryVacuum": purification.dry_vacuum,
}
"""Functions that append the steps of each action of a work-up."""
