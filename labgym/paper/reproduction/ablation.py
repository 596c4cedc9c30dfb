"""Table 3: the method without asset annotations, protocol, optimization or refinement for navigation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from labgym.eval.reports.paper import PaperTable, paper
from labgym.layouts.method import Method, Proposer
from labgym.paper.reproduction.cases import StudyVariant
from labgym.paper.reproduction.comparison import LayoutStudy, variant_key


@dataclass(frozen=True)
class RepairAblation(LayoutStudy):
    """The whole method and the method without one of its parts."""

    name: ClassVar[str] = "ablation"
    title: ClassVar[str] = "Ablation"
    heading: ClassVar[str] = "The method without one of its parts"

    def printed(self) -> PaperTable:
        """Return Table 3."""
        return paper().ablation


def ablation_variants(title: str, proposer: str | Proposer) -> tuple[StudyVariant, ...]:
    """Return the paper's four ablations in its order, what labgym adds to its phases, and the whole method.

    In the paper the optimization considers geometry and chemistry alone, and only the refinement considers navigation.
    labgym's optimization also follows facility rules, which keep fronts and ways clear. Without refinement for
    navigation both are left out; two further lines leave out one of them. The paper's ablations follow with the paper's
    phases alone.
    """
    whole = Method(proposer=proposer, on_failure="keep")
    bare = replace(whole, dress="never")
    variants = (
        *_parts(whole, replace(whole, refine=False, facility=False), pure=False),
        StudyVariant("rules-alone", "facility rules, without refinement", replace(whole, refine=False)),
        StudyVariant("refinement-alone", "refinement, without facility rules", replace(whole, facility=False)),
        StudyVariant("whole", "whole method", whole),
        *_parts(bare, replace(bare, refine=False), pure=True),
        StudyVariant("pure", "pure, whole method", bare, pure=True),
    )
    name = variant_key(title)
    return tuple(replace(one, key=f"{name}-{one.key}", title=f"{title}: {one.title}") for one in variants)


def _parts(whole: Method, unrefined: Method, pure: bool) -> tuple[StudyVariant, ...]:
    """Return the four ablations of a method.

    Args:
        unrefined: the method without refinement for navigation.
        pure: whether the phases are the paper's alone.
    """
    key, title = ("pure-", "pure, ") if pure else ("", "")
    return (
        StudyVariant(f"{key}annotations", f"{title}without annotations", whole, "annotations", pure),
        StudyVariant(f"{key}protocol", f"{title}without protocol", whole, "protocol", pure),
        StudyVariant(
            f"{key}optimization",
            f"{title}without geometric and chemical optimization",
            replace(whole, optimise=False),
            pure=pure,
        ),
        StudyVariant(f"{key}refinement", f"{title}without refinement for navigation", unrefined, pure=pure),
    )
