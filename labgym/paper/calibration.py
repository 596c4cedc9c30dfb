"""Calibration of the sampler on the paper's rows without optimization: `python -m labgym.paper.calibration`.

It multiplies three groups of the sampler's rates by one factor each, so that its proposals for the protocols, rooms and
seeds of the published split `val` have the paper's mean numbers of objects out of bounds and of collisions, and its
share of feasible transitions. The rates before and after are published once, in `assets/layouts/sampler.json`, and do
not change when optimizers or metrics do.
"""

from __future__ import annotations

import argparse
import datetime
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from labgym.artefacts import artefacts
from labgym.eval.reports.paper import paper
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.eval.scoring.score import score
from labgym.layouts.generate import resolve_request
from labgym.layouts.places import published_protocols
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule_sets import PAPER
from labgym.layouts.rules.whereabouts import missing_assets
from labgym.layouts.splits import manifest
from labgym.paper.sampler import Rates, SamplerFile, SamplerProposer
from labgym.paper.sampler.rates import GROUPS, Figure, calibration

SEEDS = 10
"""Number of seeds of each entry of `val`: the published one and following ones, all in the range of val."""
SPACING = 1000
"""Distance between the seeds of an entry."""
ROUNDS = 12
"""Maximum number of corrections of the factors."""
CLOSE = 0.01
"""Relative difference from a target at which it counts as reached."""
UNOPTIMISED = "LabBuilder (w/o geom. & chem. opt.)"
UNREFINED = "LabBuilder (w/o nav. opt.)"
"""Rows of the paper's Table 3."""


@dataclass(frozen=True)
class Proposal:
    """The scores of a proposal, and whether it places everything required, in bounds or not."""

    report: LayoutReport
    complete: bool


@dataclass(frozen=True)
class Target:
    """A printed figure, the group of rates that is fitted to it, and whether larger rates raise it."""

    figure: str
    group: str
    paper: float


def targets() -> tuple[Target, ...]:
    """Return what is fitted."""
    before, unrefined = paper().ablation.row(UNOPTIMISED), paper().ablation.row(UNREFINED)
    return (
        Target("ob", "bounds", _number(before, "ob")),
        Target("cn", "collisions", _number(before, "cn")),
        Target("step_nav", "navigation", _number(unrefined, "step_nav")),
    )


def proposals(rates: Rates, seeds: int = SEEDS, layouts: int | None = None) -> list[list[Proposal]]:
    """Return the scores of proposals for `val`, one list for each of several seeds of its entries.

    Args:
        rates: of the sampler.
        seeds: number of seeds of each entry.
        layouts: number of entries, from the first; None for all.
    """
    return [
        [_proposal(rates, entry.protocol, entry.seed + SPACING * repeat, entry.room) for entry in some]
        for some in [manifest("val").layouts[:layouts]]
        for repeat in range(seeds)
    ]


def _proposal(rates: Rates, protocol: str, seed: int, room: str) -> Proposal:
    request = resolve_request(published_protocols()[protocol], seed, room, rules=PAPER)
    layout = SamplerProposer(rates).propose(request)
    absent = missing_assets(Arrangement.of(layout), request.protocol, frozenset())
    return Proposal(score(layout, contacts=False, rules=PAPER), not absent)


def value(name: str, some: Iterable[Proposal]) -> float:
    """Return a figure over some proposals: `step_nav` is the share of all their transitions, others are means.

    Args:
        name: field of `LayoutReport`, with `gated_` before it for a gated score, or `asset_placed`.
    """
    some = list(some)
    if name == "step_nav":
        reports = [proposal.report for proposal in some]
        total = sum(report.transitions for report in reports)
        return sum((report.step_nav or 0.0) * report.transitions for report in reports) / total
    return float(np.mean([each for proposal in some if (each := _of(proposal, name)) is not None]))


def fit(assumed: Rates, seeds: int = SEEDS) -> tuple[dict[str, float], Rates]:
    """Return the factors of the groups, and the rates, with which the targets are reached."""
    factors = dict.fromkeys(GROUPS, 1.0)
    for _ in range(ROUNDS):
        rates = assumed.scaled(factors)
        everything = [proposal for some in proposals(rates, seeds) for proposal in some]
        ratios = {target.group: _ratio(target, value(target.figure, everything)) for target in targets()}
        if all(abs(ratio - 1.0) < CLOSE for ratio in ratios.values()):
            break
        factors = {group: round(factor * ratios[group], 4) for group, factor in factors.items()}
    return factors, assumed.scaled(factors)


def figures(rates: Rates, seeds: int = SEEDS) -> tuple[Figure, ...]:
    """Return the figures of the sampler with some rates, the fitted ones first, with their spread."""
    results = proposals(rates, seeds)
    fitted = {target.figure: target.paper for target in targets()}
    table = paper().ablation
    row = {**table.row(UNOPTIMISED), "prot_nav": table.row(UNREFINED)["prot_nav"]}
    names = [*fitted, "obj", "asset", "asset_placed", "prot_nav"]
    names += ["gated_flam", "gated_store", "gated_incomp", "gated_glass", "flam", "store", "incomp", "glass"]
    names += ["store_class", "v", "fitness"]
    return tuple(_figure(name, results, fitted, row) for name in names)


def calibrate(seeds: int = SEEDS) -> SamplerFile:
    """Return the calibration anew, from the assumed rates of the published one, dated today."""
    published = calibration()
    factors, rates = fit(published.assumed, seeds)
    update = {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "layouts": seeds * len(manifest("val").layouts),
        "factors": factors,
        "rates": rates,
        "figures": figures(rates, seeds),
    }
    return published.model_copy(update=update)


def _ratio(target: Target, reached: float) -> float:
    """The factor by which a group of rates is multiplied next; for navigation the failures count."""
    if target.figure == "step_nav":
        return (1.0 - target.paper) / max(1.0 - reached, 1e-3)
    return target.paper / max(reached, 1e-3)


def _figure(
    name: str, results: Sequence[Sequence[Proposal]], fitted: dict[str, float], row: dict[str, str | int | float | None]
) -> Figure:
    everything = [proposal for some in results for proposal in some]
    means = np.array([value(name, some) for some in results])
    half = 1.96 * float(means.std(ddof=1)) / len(means) ** 0.5 if len(means) > 1 else 0.0
    reached = value(name, everything)
    single = [each for proposal in everything if (each := _of(proposal, name)) is not None]
    printed = fitted.get(name, row.get(name.removeprefix("gated_").removesuffix("_placed")))
    known = name in fitted or name.startswith("gated_") or name in ("obj", "asset", "asset_placed", "prot_nav")
    return Figure(
        name=name,
        paper=float(printed) if known and isinstance(printed, int | float) else None,
        fitted=name in fitted,
        reached=round(reached, 4),
        low=round(reached - half, 4),
        high=round(reached + half, 4),
        deviation=round(float(np.std(single, ddof=1)), 4),
    )


def _of(proposal: Proposal, name: str) -> float | None:
    if name == "asset_placed":
        return float(proposal.complete)
    gated = name.removeprefix("gated_")
    scored: float | None = getattr(proposal.report.gated if name != gated else proposal.report, gated)
    return scored


def _number(row: dict[str, str | int | float | None], name: str) -> float:
    number = row[name]
    assert isinstance(number, int | float)
    return float(number)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the figures of the published rates, compare them, or calibrate anew."""
    parser = argparse.ArgumentParser(prog="python -m labgym.paper.calibration", description=__doc__)
    parser.add_argument("--check", action="store_true", help="repeat the fit, and compare the result with the file")
    parser.add_argument("--write", action="store_true", help="calibrate anew and write assets/layouts/sampler.json")
    options = parser.parse_args(arguments)
    path = artefacts("assets") / "layouts" / "sampler.json"
    if options.write:
        calibrate().save(path)
    published = SamplerFile.load(path)
    sys.stdout.write(table(figures(published.rates)))
    if options.check and fit(published.assumed)[1] != published.rates:
        sys.stderr.write(f"the fit gives other rates than {path}\n")
        return 1
    return 0


def table(rows: Iterable[Figure]) -> str:
    """Return figures as lines of text: name, the paper's, reached, its interval, and whether it was fitted."""
    lines = []
    for row in rows:
        printed = "" if row.paper is None else f"{row.paper:.3f}"
        interval = f"[{row.low:.3f}, {row.high:.3f}]"
        lines.append(f"{row.name:14} {printed:>8} {row.reached:8.3f} {interval:18} {'fitted' if row.fitted else ''}")
    return "\n".join(line.rstrip() for line in lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
