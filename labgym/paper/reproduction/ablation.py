"""Table 3: the method without asset annotations, protocol, optimization or refinement for navigation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from labgym.eval.reports.paper import PaperTable, paper
from labgym.layouts.method import Method
from labgym.paper.reproduction.cases import StudyVariant
from labgym.paper.reproduction.comparison import LayoutStudy


@dataclass(frozen=True)
class RepairAblation(LayoutStudy):
    """The whole method and the method without one of its parts."""

    name: ClassVar[str] = "ablation"
    title: ClassVar[str] = "Ablation"
    heading: ClassVar[str] = "The method without one of its parts"

    def printed(self) -> PaperTable:
        """Return Table 3."""
        return paper().ablation


def ablation_variants(proposer: str) -> tuple[StudyVariant, ...]:
    """Return the paper's four ablations in its order, what labgym adds to its phases, and the whole method.

    In the paper the optimization considers geometry and chemistry alone, and only the refinement considers navigation.
    labgym's optimization also follows facility rules, which keep fronts and ways clear. Without refinement for
    navigation both are left out; two further lines leave out one of them.
    """
    whole = Method(proposer=proposer, on_failure="keep")
    variants = (
        StudyVariant("annotations", "without annotations", whole, "annotations"),
        StudyVariant("protocol", "without protocol", whole, "protocol"),
        StudyVariant("optimization", "without geometric and chemical optimization", replace(whole, optimise=False)),
        StudyVariant("refinement", "without refinement for navigation", replace(whole, refine=False, facility=False)),
        StudyVariant("rules-alone", "facility rules, without refinement", replace(whole, refine=False)),
        StudyVariant("refinement-alone", "refinement, without facility rules", replace(whole, facility=False)),
        StudyVariant("whole", "whole method", whole),
    )
    return tuple(
        StudyVariant(f"{proposer}-{one.key}", f"{proposer}, {one.title}", one.method, one.hidden) for one in variants
    )
