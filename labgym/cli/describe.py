"""Assets, protocols, experiments, layout scores and episodes as plain text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from labgym.assets import Catalog, incompatible
from labgym.assets.reactivity import Reaction, products, reactions, to_avoid
from labgym.assets.specs import quantity, value_text
from labgym.protocols.stoichiometry import StoichiometryRow, Use, stoichiometry, waste
from labgym.table import Table, number

if TYPE_CHECKING:
    from labgym.assets import Asset, Match
    from labgym.assets.inference import Inference, LabelAgreement
    from labgym.eval.driving.episode_row import LabNavRow, TransitionRow
    from labgym.eval.scoring.layout_report import LayoutReport
    from labgym.layouts.rules.regulations import Ruling
    from labgym.protocols import Protocol
    from labgym.protocols.experiments import Experiment
    from labgym.protocols.experiments.feasibility import FeasibilityVerdict
    from labgym.protocols.retrieval import SearchResults


def asset_table(assets: Iterable[Asset]) -> str:
    """Return a table of assets: name, kind, category, size and hazards."""
    rows = tuple((a.name, a.kind, a.category, _size(a), ", ".join(_hazards(a)) or "-") for a in assets)
    return Table(
        f"{len(rows)} assets", ("name", "kind", "category", "width x depth x height, m", "hazards"), rows
    ).text()


def asset_details(asset: Asset) -> str:
    """Return an asset's properties, one per line."""
    facts = [
        ("kind", f"{asset.kind}, {asset.category}, {asset.subtype}"),
        ("also called", ", ".join((*asset.synonyms_en, *asset.synonyms_zh))),
        ("size", f"{_size(asset)} m (width x depth x height), {asset.mass:g} kg"),
        ("stands on", {"floor": "the floor", "desktop": "a surface", "wall": "a wall"}[asset.placing]),
        ("hazards", ", ".join(_hazards(asset))),
        ("heat source", asset.heat_class or ""),
        ("stores", f"{asset.storage_class} reagents" if asset.storage_class else ""),
        ("surfaces", ", ".join(f"{s.width:g} x {s.depth:g} m at {s.z:g} m" for s in asset.surfaces)),
        ("clearance", f"{asset.clearance:g} m in front" if asset.clearance else ""),
        *_chemistry(asset),
        *((quantity(name)[0], value_text(name, value)) for name, value in asset.specs.items()),
    ]
    return "\n".join([asset.name, asset.description, asset.caption, "", *_facts(facts)])


def compatibility_details(a: Asset, b: Asset) -> str:
    """Return what happens when two reagents mix, why, and the source, worst reaction first.

    The order of the reagents does not matter.
    """
    pairings = reactions(a, b)
    worst, alone = pairings[0], a.name == b.name
    names = f"{a.name} with itself" if alone else f"{worst.first.asset} and {worst.second.asset}"
    answers: dict[tuple[str, str], list[Reaction]] = {}
    for reaction in [item for item in pairings if item.rank] or pairings:
        answers.setdefault((reaction.cell.severity, reaction.cell.hazard), []).append(reaction)
    lines = [f"{names}: {worst.cell.severity}", *sorted({*_inferred(a), *_inferred(b)})]
    for (severity, hazard), alike in answers.items():
        facts = [
            (severity, hazard),
            ("products", ", ".join(products(alike[0], a, b))),
            ("because", "; ".join(_because(reaction) for reaction in alike)),
            ("source", "; ".join(dict.fromkeys(part for item in alike for part in item.cell.source.split("; ")))),
        ]
        lines += ["", *_facts(facts, len("incompatible"))]
    if not alone:
        rule = incompatible(a, b)
        distance = f"keep them apart (rule {rule.kind})" if rule else "may place them together"
        lines += ["", *_facts([("layouts", distance)], len("incompatible"))]
    return "\n".join(lines)


def compatibility_table(asset: Asset, others: Iterable[Asset]) -> str:
    """Return a table of the reagents that one must not be mixed with, worst first, then its reaction with itself."""
    avoided = to_avoid(asset, others)
    rows = tuple((r.cell.severity, name, r.cell.hazard, _groups(r, asset)) for name, r in avoided)
    heading = f"{asset.name} must not be mixed with {len(rows)} reagents"
    heading = "\n".join([heading, *_inferred(asset)])
    text = Table(heading, ("severity", "reagent", "hazard", "because"), rows).text() if rows else heading
    alone = reactions(asset, asset)[0]
    return text + (f"\n\nWith itself: {alone.cell.severity}: {alone.cell.hazard}" if alone.rank else "")


def inference_details(inference: Inference) -> str:
    """Return the properties inferred from a structure, each with its reason and confidence."""
    facts = [
        ("SMILES", inference.smiles),
        ("formula", f"{inference.formula}, {inference.molar_mass:.2f} g/mol"),
        ("state", f"{inference.state}, proposed"),
        ("boiling point", _near(inference.boiling_point, inference.measured)),
        ("flash point", _near(inference.flash_point)),
        ("storage class", f"{inference.storage_class}: {inference.storage_reason}"),
    ]
    rows = tuple(
        (kind, label.replace("_", " "), reason.why, reason.part or "-", f"{reason.confidence:.2f}")
        for kind, labels in (("group", inference.groups), ("flag", inference.flags))
        for label, why in labels.items()
        for reason in why
    )
    heading = "Inferred from the structure by rules, not measured. Read the safety data sheet."
    columns = ("kind", "inferred", "because", "part", "confidence")
    table = Table(heading, columns, rows).text() if rows else f"{heading}\nNo rule matches any part of it."
    return "\n".join([*_facts(facts), "", table])


def agreement_table(agreement: LabelAgreement) -> str:
    """Return how inferred groups and flags agree with the catalog: counts, precision, recall, disagreements."""
    rows = tuple(
        (
            kind,
            score.label.replace("_", " "),
            f"{score.right + score.missed}",
            f"{score.wrong}",
            f"{score.missed}",
            number(score.precision, 3),
            number(score.recall, 3),
        )
        for kind in agreement.scores
        for score in (*agreement.scores[kind], agreement.total(kind))
    )
    columns = ("kind", "label", "in catalog", "wrong", "missed", "precision", "recall")
    exact = ", ".join(f"all {kind} of {count}" for kind, count in agreement.exact.items())
    differs = tuple(
        (item.name, item.kind, item.label, "inferred" if item.inferred else "missed")
        for item in agreement.disagreements
    )
    scores = Table(f"{agreement.substances} reagents: {exact} agree", columns, rows).text()
    return "\n\n".join(
        [scores, Table(f"{len(differs)} disagreements", ("reagent", "kind", "label", "is"), differs).text()]
        if differs
        else [scores]
    )


def match_details(match: Match, asset: Asset) -> str:
    """Return the matching asset, how it was matched, and the qualifiers in the text."""
    how = {
        "name": "exact name" if match.form == asset.name else f"name {match.form}, in the requested size",
        "synonym": f'synonym "{match.form}"',
        "fuzzy": f'fuzzy match with "{match.form}", score {match.score:.2f}',
    }
    facts = [("matched by", how[match.how]), ("qualifiers", ", ".join(match.aside)), ("note", match.note)]
    return "\n".join([f"{asset.name} ({asset.kind}, {asset.category})", asset.description, "", *_facts(facts)])


def match_table(matches: Sequence[Match]) -> str:
    """Return a table of candidate assets: name, score and the nearest form of the name."""
    rows = tuple((match.name, f"{match.score:.2f}", match.form) for match in matches)
    return Table(f"{len(rows)} candidates", ("name", "score", "nearest form"), rows).text()


def protocol_table(protocols: Iterable[Protocol]) -> str:
    """Return a table of protocols: id, name, type and counts."""
    rows = tuple(
        (
            p.id,
            p.name,
            p.reaction_type or "-",
            str(len(p.reagents)),
            str(len(p.instruments)),
            str(len(p.steps)),
            str(p.moves),
        )
        for p in protocols
    )
    columns = ("id", "name", "reaction type", "reagents", "instruments", "steps", "moves")
    return Table(f"{len(rows)} protocols", columns, rows).text()


def protocol_details(protocol: Protocol) -> str:
    """Return a protocol's product, reagents, instruments, route and steps."""
    reagents = [f"{r.name}" + (f" ({r.role}{', ' + r.amount if r.amount else ''})") for r in protocol.reagents]
    facts = [
        ("type", (protocol.reaction_type or "").replace("_", " ")),
        ("reaction", protocol.reaction),
        ("product", protocol.product),
        ("reagents", ", ".join(reagents)),
        ("substances", ", ".join(f"{s.name} ({s.smiles or 'no structure'})" for s in protocol.substances)),
        ("partial", "; ".join(protocol.partial)),
        ("instruments", ", ".join(protocol.instruments)),
        ("route", " -> ".join(protocol.route)),
    ]
    steps = [f"  {step.index:>2}. {step.location}: {step.text}" for step in protocol.steps]
    catalog = Catalog.load()
    uses = [
        Use(reagent.name, reagent.amount, reagent.role, catalog.get(reagent.name) if reagent.name in catalog else None)
        for reagent in protocol.reagents
    ]
    tables = batch_tables(uses)
    lines = [f"{protocol.id}  {protocol.name}", protocol.description, "", *_facts(facts), "", *steps]
    return "\n".join([*lines, *(["", tables] if tables else [])])


def batch_tables(uses: Sequence[Use]) -> str:
    """Return the tables of stoichiometry and waste of a batch; "" if nothing is known."""
    rows = tuple(
        (row.name, *(_measure(value) for value in _batch(row)), "limiting" if row.limiting else "")
        for row in stoichiometry(uses)
    )
    columns = ("reactant", "mmol", "g", "mL", "equivalents", "")
    streams = tuple(
        (stream.kind, _measure(stream.milliliters or None), _measure(stream.grams or None), ", ".join(stream.names))
        for stream in waste(uses)
    )
    tables = [Table("stoichiometry", columns, rows).text()] if rows else []
    if streams:
        note = "amounts that the text states; volumes without an amount are not counted"
        tables.append(Table("waste", ("stream", "mL", "g", "from"), streams, (note,)).text())
    return "\n\n".join(tables)


def _batch(row: StoichiometryRow) -> tuple[float | None, ...]:
    return (None if row.moles is None else 1000.0 * row.moles, row.mass, row.volume, row.equivalents)


def _measure(value: float | None) -> str:
    return "-" if value is None else f"{float(f'{value:.3g}'):g}"


def search_results(results: SearchResults) -> str:
    """Return a table of the fragments of a search: source, scores and first words."""
    rows = tuple(
        (
            hit.fragment.place,
            f"{hit.score:.4f}",
            f"{hit.keyword:.2f}",
            "-" if hit.similarity is None else f"{hit.similarity:.3f}",
            _beginning(hit.fragment.text),
        )
        for hit in results.hits
    )
    method = results.method + (f" ({results.note})" if results.note else "")
    heading = f"{len(rows)} fragments, {method}" if rows else f"no fragments, {method}"
    return Table(heading, ("source", "score", "BM25", "cosine", "fragment"), rows).text()


def experiment_table(experiments: Sequence[Experiment]) -> str:
    """Return a table of experiments: id, name, type and counts."""
    rows = tuple(
        (item.id, item.name, item.reaction_type or "-", str(len(item.materials)), str(len(item.actions)))
        for item in experiments
    )
    return Table(f"{len(rows)} experiments", ("id", "name", "reaction type", "materials", "actions"), rows).text()


def experiment_details(experiment: Experiment, catalog: Catalog) -> str:
    """Return an experiment's product, materials and actions."""
    from labgym.protocols.experiments.narration import sentence

    facts = [
        ("type", (experiment.reaction_type or "").replace("_", " ")),
        ("also called", ", ".join(experiment.synonyms)),
        ("reaction", experiment.reaction),
        ("product", experiment.product),
        ("materials", ", ".join(f"{item.name} ({item.role})" for item in experiment.materials)),
        ("license", experiment.license),
    ]
    actions = [f"  {k:>2}. {sentence(action, catalog)}" for k, action in enumerate(experiment.actions, 1)]
    return "\n".join([f"{experiment.id}  {experiment.name}", experiment.description, "", *_facts(facts), "", *actions])


def verdict_table(verdicts: Sequence[FeasibilityVerdict]) -> str:
    """Return how many experiments are feasible, and a table of the obstacles to the others."""
    possible = sum(verdict.feasible for verdict in verdicts)
    rows = tuple(
        (verdict.experiment.id, obstacle.code, str(obstacle.action or "-"), obstacle.message)
        for verdict in verdicts
        for obstacle in verdict.obstacles
    )
    heading = f"{possible} of {len(verdicts)} experiments are feasible"
    return Table(heading, ("experiment", "obstacle", "action", "why"), rows).text() if rows else heading


def layout_score(report: LayoutReport) -> str:
    """Return a layout's metrics, one per line, then missing assets, violations and warnings."""
    from labgym.eval.reports.tables import layout_columns

    columns = [column for column in layout_columns((report.rules,)) if column[0] != "v"]
    facts = [(heading, number(getattr(report, key), digits)) for key, heading, digits in columns]
    extra = [("v", str(report.v)), ("fitness", number(report.fitness, 3)), ("S_phys", f"{report.s_phys:.1f} of 35")]
    extra += [("S_chem", f"{report.s_chem:.1f} of 35")] if report.s_chem is not None else []
    extra += _judged(report)
    head = f"{report.layout}: rules {report.rules}, profile {report.profile}, protocol {report.protocol or 'none'}"
    lines = [f"missing: {', '.join(report.missing)}"] if report.missing else []
    lines += [f"violation: {item.message}; {item.suggestion}" for item in report.violations]
    lines += [
        f"{'facility error' if item.severity == 'error' else 'warning'}: {item.message} [{item.source}]"
        for item in report.warnings
    ]
    return "\n".join([head, "", *_facts(facts + extra), *([""] if lines else []), *lines])


def regulation_table(layout: str, regulations: str, rulings: Sequence[Ruling]) -> str:
    """Return a table of the rulings of a regulation profile on a layout."""
    rows = tuple(
        (
            ruling.outcome,
            number(ruling.value, 2),
            f"{ruling.sense} {ruling.limit:g}",
            ruling.requires,
            ruling.where,
            f"{ruling.source}{'' if ruling.basis == 'read' else ' *'}",
        )
        for ruling in rulings
    )
    failed = sum(ruling.outcome == "fail" for ruling in rulings)
    applied = sum(ruling.outcome != "does not apply" for ruling in rulings)
    heading = f"{layout}, {regulations}: {applied - failed} of {applied} clauses that apply are met"
    columns = ("ruling", "value", "limit", "requirement", "where", "source")
    return Table(heading, columns, rows, notes=("* The figure was not checked against the clause.",)).text()


def _judged(report: LayoutReport) -> list[tuple[str, str]]:
    """Return the scores of a vision-language model with their spread over its samples, and the total."""
    judgement = report.judgement
    if judgement is None or report.s_consist is None:
        return []
    from labgym.eval.scoring.judgement import DIMENSIONS

    facts = [
        (heading, f"{judgement.mean(dimension):.1f} of 10, spread {judgement.spread(dimension):.1f}")
        for heading, dimension in zip(("Real", "Lay", "Comp"), DIMENSIONS, strict=True)
    ]
    unusable = f", {judgement.unusable} unusable" if judgement.unusable else ""
    by = f"{judgement.model}, {judgement.mode}, {len(judgement.samples)} samples{unusable}"
    facts.append(("S_consist", f"{report.s_consist:.1f} of 30, spread {judgement.spread():.1f} ({by})"))
    zeros = sorted({condition for sample in judgement.samples for condition in sample.hard_zeros})
    facts += [("hard zeros", ", ".join(zeros))] if zeros else []
    return facts + ([("total", f"{report.total:.1f} of 100")] if report.total is not None else [])


def episode_outcome(row: TransitionRow) -> str:
    """Return how an episode ended, after which time and distance."""
    if row.error is not None:
        end = f"the policy failed after {row.time:.1f} s"
    elif row.success:
        end = f"goal reached after {row.time:.1f} s"
    else:
        end = f"time limit of {row.time:g} s reached, {row.final_distance:.2f} m from the goal"
    return f"{end}, {row.path_length:.2f} m driven"


def labnav_outcome(row: LabNavRow) -> str:
    """Return how an episode of LabNav ended, after which time and with which score."""
    contact = f" ({row.contact})" if row.contact else ""
    return f"{row.key}: {row.ending}{contact} after {row.time:.1f} s, score {row.score:.3f}"


def _because(reaction: Reaction) -> str:
    sides = (reaction.first, reaction.second)
    return " with ".join(f"{_spaced(side.group)} ({side.asset})" for side in sides)


def _groups(reaction: Reaction, asset: Asset) -> str:
    """Return the reactive groups of a reaction, the asset's group last."""
    sides = sorted((reaction.first, reaction.second), key=lambda side: side.asset == asset.name)
    return " with ".join(_spaced(side.group) for side in sides)


def _inferred(asset: Asset) -> list[str]:
    """Return a line that says how a reagent's groups were inferred; none if they come from the catalog."""
    chemistry = asset.chemistry
    if chemistry is None:
        return []
    from labgym.assets.inference.bottle import INFERRED_NOTE

    if not chemistry.notes.startswith(INFERRED_NOTE):
        return []
    return [f"{asset.name} is {chemistry.smiles}, its groups {chemistry.notes.replace('_', ' ')}"]


def _spaced(group: str) -> str:
    return group.replace("_", " ")


def _facts(facts: Iterable[tuple[str, str]], width: int = 0) -> list[str]:
    present = [(name, value) for name, value in facts if value]
    width = max(width, *(len(name) for name, _ in present))
    return [f"{name:<{width}}  {value}" for name, value in present]


def _near(celsius: float | None, measured: bool = False) -> str:
    if celsius is None:
        return ""
    return f"{celsius:g} C, measured" if measured else f"near {celsius:.0f} C, estimated"


def _beginning(text: str, width: int = 90) -> str:
    return text if len(text) <= width else text[: width - 3] + "..."


def _size(asset: Asset) -> str:
    return f"{asset.size.width:g} x {asset.size.depth:g} x {asset.size.height:g}"


def _hazards(asset: Asset) -> list[str]:
    chemical = ("water_reactive", "pyrophoric", "peroxide_former")
    others = [name for name in chemical if asset.chemistry is not None and getattr(asset.chemistry, name)]
    return [_spaced(name) for name in (*(name for name, value in asset.hazards if value), *others)]


def _chemistry(asset: Asset) -> list[tuple[str, str]]:
    chemistry = asset.chemistry
    if chemistry is None:
        return []
    return [
        ("CAS", chemistry.cas or ""),
        ("SMILES", chemistry.smiles or ""),
        ("formula", chemistry.formula or ""),
        ("boiling point", "" if chemistry.boiling_point is None else f"{chemistry.boiling_point:g} C"),
        ("flash point", "" if chemistry.flash_point is None else f"{chemistry.flash_point:g} C"),
        ("H statements", ", ".join(chemistry.h_codes)),
        ("storage class", chemistry.storage_class),
    ]
