"""Table 3: the method without asset annotations, protocol, optimization or refinement for navigation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from labgym.eval.reports.paper import PaperTable, paper
from labgym.eval.reproduction.cases import Variant
from labgym.eval.reproduction.comparison import LayoutStudy
from labgym.layouts.method import Method


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
    """Return the whole method and the four ablations, in the paper's order, for a proposer."""
    whole = Method(proposer=proposer, on_failure="keep")
    no_optimisation = Method(proposer=proposer, optimise=False, on_failure="keep")
    no_refinement = Method(proposer=proposer, refine=False, on_failure="keep")
    variants = (
        Variant("annotations", "without annotations", whole, "annotations"),
        Variant("protocol", "without protocol", whole, "protocol"),
        Variant("optimization", "without geometric and chemical optimization", no_optimisation),
        Variant("refinement", "without refinement for navigation", no_refinement),
        Variant("whole", "whole method", whole),
    )
    return tuple(
        Variant(f"{proposer}-{one.key}", f"{proposer}, {one.title}", one.method, one.hidden) for one in variants
    )
