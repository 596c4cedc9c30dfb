"""Table 3: the method without asset annotations, protocol, optimization or refinement for navigation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from labgym.eval.reports.paper import PaperTable, paper
from labgym.layouts.method import Method
from labgym.paper.reproduction.cases import Variant
from labgym.paper.reproduction.comparison import LayoutStudy


@dataclass(frozen=True)
class AblationStudy(LayoutStudy):
    """The whole method and the method without one of its parts."""

    name: ClassVar[str] = "ablation"
    title: ClassVar[str] = "Ablation"
    heading: ClassVar[str] = "The method without one of its parts"

    def printed(self) -> PaperTable:
        """Return Table 3."""
        return paper().ablation


def ablation_variants(proposer: str) -> tuple[Variant, ...]:
    """Return the paper's four ablations in its order, what labgym adds to its phases, and the whole method.

    In the paper the optimization considers geometry and chemistry alone, and only the refinement considers navigation.
    labgym's optimization also follows facility rules, which keep fronts and ways clear. Without refinement for
    navigation both are left out; two further lines leave out one of them.
    """
    whole = Method(proposer=proposer, on_failure="keep")
    variants = (
        Variant("annotations", "without annotations", whole, "annotations"),
        Variant("protocol", "without protocol", whole, "protocol"),
        Variant("optimization", "without geometric and chemical optimization", replace(whole, optimise=False)),
        Variant("refinement", "without refinement for navigation", replace(whole, refine=False, facility=False)),
        Variant("rules-alone", "facility rules, without refinement", replace(whole, refine=False)),
        Variant("refinement-alone", "refinement, without facility rules", replace(whole, facility=False)),
        Variant("whole", "whole method", whole),
    )
    return tuple(
        Variant(f"{proposer}-{one.key}", f"{proposer}, {one.title}", one.method, one.hidden) for one in variants
    )
