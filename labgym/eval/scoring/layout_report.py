"""Records of the layout evaluation: one layout's report, and the mean over many."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document, Record
from labgym.layouts.rules.facility import FacilityWarning

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Count = Annotated[int, Field(ge=0)]


class Gated(Record):
    """Chemical scores times the layout's Asset bit; None where the score is, or without a protocol."""

    flam: Share | None = None
    store: Share | None = None
    incomp: Share | None = None
    glass: Share | None = None


class Physical(Record):
    """S_phys out of 35: shares of objects without the fault, times the points.

    Attributes:
        tabletop_bounds: of 10, desktop items within their surface (and the room).
        desktop_collisions: of 10, desktop items in no collision.
        heights: of 5, all objects at the height of what carries them.
        room: of 10, floor and wall objects within the room, at their wall and in no collision.
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
    """One rule of the consistency proxy: its dimension, its score in [0, 1] and what it was taken from."""

    dimension: str
    rule: str
    score: Share
    detail: str = ""


class ConsistencyProxy(Record):
    """Rules in place of a vision-language model; never to be put in the model's columns.

    Attributes:
        realism, layout, completeness: each of 10, ten times the mean of its rules.
    """

    realism: float
    layout: float
    completeness: float
    rules: tuple[RuleScore, ...]

    @property
    def total(self) -> float:
        """Sum of the three, of 30."""
        return self.realism + self.layout + self.completeness


class ReportedViolation(Record):
    """A hard violation: who, by how much (metres; 1 where it is a count), what is wrong and what would mend it."""

    kind: str
    ids: tuple[str, ...]
    amount: float
    message: str
    suggestion: str


class LayoutReport(Document):
    """LabTouchstone of one layout. None means that a metric does not apply: it is left out of means.

    Attributes:
        layout, layout_hash, protocol, profile, version: what was scored, under which definitions.
        obj: placed objects, without doors, windows and robots.
        ob: objects out of bounds. cn, cn_sw: colliding pairs; also sharing more than 1e-4 m3.
        cn_mj: colliding pairs by MuJoCo's contacts; None where it was switched off.
        asset: 1 where all required assets are there; None without a protocol. missing: those that are not.
        step_nav: share of the protocol's transitions with a collision-free path; prot_nav: 1 where all have one.
        transitions: how many there are.
        flam, store, incomp, glass: chemical safety. gated: the same times `asset`.
        incomp_contained: Incomp where separate closed cabinets count as separated.
        store_class: share of reagents in a cabinet of their own storage class.
        instances: how many instances each chemical score is taken from.
        v, fitness: the generator's objective, navigation included in v.
        physical, s_phys: of 35. s_chem: of 35, None where no chemical score applies.
        real, lay, comp, s_consist: by a vision-language model; None without one.
        consistency_proxy: rules in its place.
        total: S_phys + S_chem + S_consist, None without a model.
        total_with_proxy: the same with the proxy as the third part.
    """

    SCHEMA: ClassVar[str] = "labgym.layout-report/1"

    layout: str
    layout_hash: str
    protocol: str | None
    profile: str
    version: str
    obj: Count
    ob: Count
    cn: Count
    cn_sw: Count
    cn_mj: Count | None
    asset: Annotated[int, Field(ge=0, le=1)] | None
    missing: tuple[str, ...]
    step_nav: Share | None
    prot_nav: Annotated[int, Field(ge=0, le=1)] | None
    transitions: Count
    flam: Share | None
    store: Share | None
    incomp: Share | None
    glass: Share | None
    gated: Gated
    incomp_contained: Share | None
    store_class: Share | None
    instances: dict[str, Count]
    v: Count
    fitness: Share
    physical: Physical
    s_phys: float
    s_chem: float | None
    real: float | None = None
    lay: float | None = None
    comp: float | None = None
    s_consist: float | None = None
    consistency_proxy: ConsistencyProxy
    total: float | None = None
    total_with_proxy: float | None = None
    violations: tuple[ReportedViolation, ...]
    warnings: tuple[FacilityWarning, ...]


class MetricMean(Record):
    """Mean of one metric over the layouts where it applies.

    Attributes:
        mean: None where it applies nowhere.
        count: layouts where it applies. nulls: layouts where it does not.
    """

    mean: float | None
    count: Count
    nulls: Count


class LayoutSummary(Document):
    """Means over layouts, metric by metric; `metrics[name].mean`.

    Attributes:
        layouts: how many reports went in. profiles, versions: under which definitions, sorted.
    """

    SCHEMA: ClassVar[str] = "labgym.layout-summary/1"

    layouts: Count
    profiles: tuple[str, ...]
    versions: tuple[str, ...]
    metrics: dict[str, MetricMean]

    def mean(self, metric: str) -> float | None:
        """Return a metric's mean, None where it applies nowhere."""
        return self.metrics[metric].mean
