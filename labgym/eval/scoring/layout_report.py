"""Results of layout evaluation: the report on one layout, and means over many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from labgym.documents import Document, Growing, Record
from labgym.eval.scoring.judgement import DIMENSIONS, Judgement
from labgym.layouts.rules.regulations import Ruling
from labgym.layouts.rules.rule import FacilityIssue

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Count = Annotated[int, Field(ge=0)]
Bit = Annotated[int, Field(ge=0, le=1)]


@dataclass(frozen=True)
class MetricColumn:
    """A field of a report that is a metric.

    Attributes:
        heading: in tables; empty for metrics that tables leave out.
        digits: number of decimals there.
        paper: whether the paper has this column.
        judged: whether a vision-language model gives it.
        pooled_by: field with the number of drives behind a share of drives. Under rule sets other than `paper` the
            drives of all layouts are pooled.
    """

    heading: str = ""
    digits: int = 3
    paper: bool = False
    judged: bool = False
    pooled_by: str = ""


class Gated(Record):
    """Chemical scores multiplied by the layout's Asset bit; None if the score is None or there is no protocol."""

    flam: Share | None = None
    store: Share | None = None
    incomp: Share | None = None
    glass: Share | None = None


class PhysicalScore(Record):
    """S_phys, at most 35 points: shares of objects without a fault, multiplied by points.

    Attributes:
        tabletop_bounds: at most 10, desktop items within their surface and the room.
        desktop_collisions: at most 10, desktop items without collision.
        heights: at most 5, objects at the height of their support.
        room: at most 10, floor and wall objects within the room, at their wall and without collision.
    """

    tabletop_bounds: float
    desktop_collisions: float
    heights: float
    room: float

    @property
    def total(self) -> float:
        """Sum of the four."""
        return self.tabletop_bounds + self.desktop_collisions + self.heights + self.room


class RuleScore(Record):
    """A rule of the consistency proxy: its dimension, its score in [0, 1] and the counts behind it."""

    dimension: str
    rule: str
    score: Share
    detail: str = ""


class ConsistencyProxy(Growing):
    """Rule-based proxy for the scores of a vision-language model, reported under its own name.

    Attributes:
        realism, layout, completeness: at most 10 each, ten times the mean of their rules; 0 under a hard zero.
        rules: the score of each rule, and with a score of 0 each hard zero.
        version: of the rules; 1 has no hard zeros.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"version"})

    realism: float
    layout: float
    completeness: float
    rules: tuple[RuleScore, ...]
    version: Literal[1, 2] = 1

    @property
    def total(self) -> float:
        """Sum of the three dimensions, at most 30."""
        return self.realism + self.layout + self.completeness


class ReportedViolation(Record):
    """A hard violation: the objects, the amount (meters, or 1 for a count), a message and a suggested fix."""

    kind: str
    ids: tuple[str, ...]
    amount: float
    message: str
    suggestion: str


class LayoutReport(Growing, Document):
    """LabTouchstone metrics of one layout. A metric that does not apply is None and is left out of means.

    Fields marked with a `MetricColumn` are metrics: `aggregate` averages them, and tables show them. What a rule
    set does not measure is None or empty.

    Attributes:
        layout, layout_hash, protocol: the layout and the protocol that it was scored for.
        rules, profile: the rule set and its thresholds.
        obj: number of placed objects, without doors, windows and robots.
        ob: number of objects out of bounds.
        cn: number of colliding pairs. cn_sw: those that also share more than 1e-4 m3.
        cn_mj: number of pairs in contact in MuJoCo; None if contacts were not computed.
        asset: 1 if all required assets, and all safety equipment that the rule set requires, are placed, else 0; None
            without a protocol. missing: what is absent.
        step_nav: share of the protocol's transitions with a collision-free path. transitions: their number.
        door_nav: share of the doors of the rooms in use from which the robot reaches the first step there. entries:
            number of those doors.
        prot_nav: 1 if all drives of the rule set have a path, else 0.
        flam, store, incomp, glass: chemical safety. gated: the same scores multiplied by `asset`.
        incomp_contained: Incomp, with separate closed cabinets counted as separated.
        store_class: share of reagents in a cabinet of their storage class.
        instances: number of instances behind the score of each term.
        fronts: mean free share of the depth that the catalog requires in front of furniture.
        near, ventilate: mean satisfaction of the protocol's constraints.
        safety: share of the required kinds of safety equipment that are placed.
        facility: mean over the facility rules that apply; facility_rules: share of objects that keep each.
        hard_facility: number of broken facility rules that count in v.
        walk: walking distance of the protocol's workflow, meters; None if a walk is blocked. between_steps, fetching:
            its two parts. trips: number of trips to fetch something.
        reach: share of the items of the steps within the arm's envelope. out_of_reach: the other placements.
        regulations: rulings of each clause by regulation profile: US, EN, CN. They count in no score.
        v, fitness: the generator's objective; v includes navigation.
        physical, s_phys: at most 35 points. s_chem: at most 35 points, None if no chemical score applies.
        real, lay, comp, s_consist: scores of a vision-language model: means over its samples, at most 10 each, and
            their sum; None without a model. judgement: the samples.
        consistency_proxy: rule-based scores under their own name.
        total: S_phys + S_chem + S_consist; None without a model.
        total_with_proxy: the same with the proxy as the third part.
        violations: hard violations. warnings: facility rules that are broken, with their severity.
    """

    SCHEMA: ClassVar[str] = "labgym.layout-report/1"
    ADDED: ClassVar[frozenset[str]] = frozenset({"judgement"})

    layout: str
    layout_hash: str
    protocol: str | None
    rules: str
    profile: str
    obj: Annotated[Count, MetricColumn("Obj", 1, paper=True)]
    ob: Annotated[Count, MetricColumn("OB ↓", 2, paper=True)]
    cn: Annotated[Count, MetricColumn("CN ↓", 2, paper=True)]
    cn_sw: Annotated[Count, MetricColumn()]
    cn_mj: Annotated[Count | None, MetricColumn()]
    asset: Annotated[Bit | None, MetricColumn("Asset ↑", 3, paper=True)]
    missing: tuple[str, ...]
    step_nav: Annotated[Share | None, MetricColumn("Step nav ↑", 3, paper=True, pooled_by="transitions")] = None
    prot_nav: Annotated[Bit | None, MetricColumn("Prot nav ↑", 3, paper=True)] = None
    transitions: Count = 0
    flam: Annotated[Share | None, MetricColumn("Flam ↑", 3, paper=True)] = None
    store: Annotated[Share | None, MetricColumn("Store ↑", 3, paper=True)] = None
    incomp: Annotated[Share | None, MetricColumn("Incomp ↑", 3, paper=True)] = None
    glass: Annotated[Share | None, MetricColumn("Glass ↑", 3, paper=True)] = None
    gated: Gated
    incomp_contained: Annotated[Share | None, MetricColumn()]
    store_class: Annotated[Share | None, MetricColumn()]
    instances: dict[str, Count]
    door_nav: Annotated[Share | None, MetricColumn("Door nav ↑", 3, pooled_by="entries")] = None
    entries: Count = 0
    fronts: Annotated[Share | None, MetricColumn("Fronts ↑", 3)] = None
    near: Annotated[Share | None, MetricColumn("Near ↑", 3)] = None
    ventilate: Annotated[Share | None, MetricColumn("Ventilate ↑", 3)] = None
    safety: Annotated[Share | None, MetricColumn("Safety ↑", 3)] = None
    facility: Annotated[Share | None, MetricColumn("Facility ↑", 3)] = None
    facility_rules: dict[str, Share] = Field(default_factory=dict)
    hard_facility: Annotated[Count | None, MetricColumn()] = None
    reach: Annotated[Share | None, MetricColumn("Reach ↑", 3)] = None
    out_of_reach: tuple[str, ...] = ()
    walk: Annotated[float | None, MetricColumn("Walk, m ↓", 1)] = None
    between_steps: Annotated[float | None, MetricColumn()] = None
    fetching: Annotated[float | None, MetricColumn()] = None
    trips: Annotated[Count | None, MetricColumn()] = None
    regulations: dict[str, tuple[Ruling, ...]] = Field(default_factory=dict)
    v: Annotated[Count, MetricColumn("v ↓", 2)]
    fitness: Annotated[Share, MetricColumn()]
    physical: PhysicalScore
    s_phys: Annotated[float, MetricColumn()]
    s_chem: Annotated[float | None, MetricColumn()]
    real: Annotated[float | None, MetricColumn("Real ↑", 2, judged=True)] = None
    lay: Annotated[float | None, MetricColumn("Lay ↑", 2, judged=True)] = None
    comp: Annotated[float | None, MetricColumn("Comp ↑", 2, judged=True)] = None
    s_consist: Annotated[float | None, MetricColumn()] = None
    consistency_proxy: ConsistencyProxy
    total: Annotated[float | None, MetricColumn()] = None
    total_with_proxy: Annotated[float | None, MetricColumn()] = None
    violations: tuple[ReportedViolation, ...]
    warnings: tuple[FacilityIssue, ...]
    judgement: Judgement | None = None

    def judged(self, judgement: Judgement) -> LayoutReport:
        """Return the report with the scores of a vision-language model, and the total of 100 points."""
        real, lay, comp = (judgement.mean(dimension) for dimension in DIMENSIONS)
        points = real + lay + comp
        total = None if self.s_chem is None else self.s_phys + self.s_chem + points
        scores = {"real": real, "lay": lay, "comp": comp, "s_consist": points, "total": total}
        return self.model_copy(update={**scores, "judgement": judgement})

    @property
    def passed(self) -> bool:
        """Whether the layout has no violation, no facility error and every required asset."""
        errors = any(issue.severity == "error" for issue in self.warnings)
        return not (self.violations or self.missing or errors)


COLUMNS: dict[str, MetricColumn] = {
    name: column
    for name, info in LayoutReport.model_fields.items()
    for column in info.metadata
    if isinstance(column, MetricColumn)
}
"""The metrics of a report by field, in the order of tables."""


class MetricMean(Record):
    """Mean of a metric over the layouts to which it applies.

    Attributes:
        mean: None if it applies to no layout.
        count: layouts to which it applies. nulls: the other layouts.
    """

    mean: float | None
    count: Count
    nulls: Count


class LayoutSummary(Document):
    """Means over layouts by metric: `metrics[name].mean`.

    Attributes:
        layouts: number of reports. rules, profiles: their rule sets and thresholds, sorted.
    """

    SCHEMA: ClassVar[str] = "labgym.layout-summary/1"

    layouts: Count
    rules: tuple[str, ...]
    profiles: tuple[str, ...]
    metrics: dict[str, MetricMean]

    def mean(self, metric: str) -> float | None:
        """Return a metric's mean, None if it applies to no layout."""
        return self.metrics[metric].mean
