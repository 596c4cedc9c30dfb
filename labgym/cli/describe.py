"""Assets, protocols and layout reports as plain text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from labgym.assets import Asset, Catalog, Match, incompatible
from labgym.assets.inference import Agreement, Inference
from labgym.assets.inference.bottle import INFERRED
from labgym.assets.reactivity import Reaction, products, reactions, to_avoid
from labgym.assets.specs import quantity, spoken
from labgym.eval.reports.tables import LAYOUT_COLUMNS, Table, figure
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.protocols import Protocol
from labgym.protocols.experiments import Experiment
from labgym.protocols.experiments.feasibility import Verdict
from labgym.protocols.experiments.narration import sentence
from labgym.protocols.retrieval import Results


def asset_table(assets: Iterable[Asset]) -> str:
    """Return one line an asset: name, kind, category, size and hazards."""
    rows = tuple((a.name, a.kind, a.category, _size(a), ", ".join(_hazards(a)) or "-") for a in assets)
    return Table(
        f"{len(rows)} assets", ("name", "kind", "category", "width x depth x height, m", "hazards"), rows
    ).text()


def asset_details(asset: Asset) -> str:
    """Return all that a person asks of an asset, one property a line."""
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
        *((quantity(name)[0], spoken(name, value)) for name, value in asset.specs.given()),
    ]
    return "\n".join([asset.name, asset.description, "", *_facts(facts)])


def compatibility_details(a: Asset, b: Asset) -> str:
    """Return what happens when two reagents meet, why and by what source, worst first; the order does not matter."""
    found = reactions(a, b)
    worst, alone = found[0], a.name == b.name
    names = f"{a.name} with itself" if alone else f"{worst.first.asset} and {worst.second.asset}"
    answers: dict[tuple[str, str], list[Reaction]] = {}
    for reaction in [item for item in found if item.rank] or found:
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
        apart = f"keep them apart by the rule {rule.kind}" if rule else "may put them side by side: no rule parts them"
        lines += ["", *_facts([("layouts", apart)], len("incompatible"))]
    return "\n".join(lines)


def compatibility_table(asset: Asset, others: Iterable[Asset]) -> str:
    """Return one line for each of the others that a reagent must not meet, worst first, then what it does by itself."""
    avoided = to_avoid(asset, others)
    rows = tuple((r.cell.severity, name, r.cell.hazard, _groups(r, asset)) for name, r in avoided)
    heading = f"{asset.name} must not meet {len(rows)} reagents"
    heading = "\n".join([heading, *_inferred(asset)])
    text = Table(heading, ("severity", "reagent", "hazard", "because"), rows).text() if rows else heading
    alone = reactions(asset, asset)[0]
    return text + (f"\n\nWith itself: {alone.cell.severity}: {alone.cell.hazard}" if alone.rank else "")


def inference_details(found: Inference) -> str:
    """Return what a structure says of a substance, with the reason and how sure each thing is."""
    facts = [
        ("SMILES", found.smiles),
        ("formula", f"{found.formula}, {found.molar_mass:.2f} g/mol"),
        ("state", f"{found.state}, proposed"),
        ("boiling point", "" if found.boiling_point is None else f"near {found.boiling_point:.0f} C, estimated"),
        ("flash point", "" if found.flash_point is None else f"near {found.flash_point:.0f} C, estimated"),
        ("storage class", f"{found.storage_class}: {found.storage_reason}"),
    ]
    rows = tuple(
        (kind, label.replace("_", " "), reason.why, reason.part or "-", f"{reason.confidence:.2f}")
        for kind, labels in (("group", found.groups), ("flag", found.flags))
        for label, why in labels.items()
        for reason in why
    )
    heading = "Inferred from the structure by rules; nothing was measured. Read the safety data sheet."
    columns = ("kind", "inferred", "because", "part", "confidence")
    table = Table(heading, columns, rows).text() if rows else f"{heading}\nNo rule knows a part of it."
    return "\n".join([*_facts(facts), "", table])


def agreement_table(found: Agreement) -> str:
    """Return how inferred groups and flags agree with the catalogue: counts, precision, recall, exceptions."""
    rows = tuple(
        (
            kind,
            score.label.replace("_", " "),
            f"{score.right + score.missed}",
            f"{score.wrong}",
            f"{score.missed}",
            figure(score.precision, 3),
            figure(score.recall, 3),
        )
        for kind in found.scores
        for score in (*found.scores[kind], found.total(kind))
    )
    columns = ("kind", "label", "carried", "wrong", "missed", "precision", "recall")
    exact = ", ".join(f"all {kind} of {count}" for kind, count in found.exact.items())
    differs = tuple(
        (item.name, item.kind, item.label, "inferred" if item.inferred else "missed") for item in found.disagreements
    )
    scores = Table(f"{found.substances} reagents: {exact} agree", columns, rows).text()
    return "\n\n".join(
        [scores, Table(f"{len(differs)} disagreements", ("reagent", "kind", "label", "is"), differs).text()]
        if differs
        else [scores]
    )


def match_details(match: Match, asset: Asset) -> str:
    """Return what a search found, how, and what of the text it set aside."""
    how = {
        "name": "exact name" if match.form == asset.name else f"name {match.form}, of the size that is asked",
        "synonym": f'synonym "{match.form}"',
        "fuzzy": f'fuzzy, nearest to "{match.form}", score {match.score:.2f}',
    }
    facts = [("found by", how[match.how]), ("set aside", ", ".join(match.aside)), ("note", match.note)]
    return "\n".join([f"{asset.name} ({asset.kind}, {asset.category})", asset.description, "", *_facts(facts)])


def match_table(matches: Sequence[Match]) -> str:
    """Return one line an asset that is near to a text: name, score and the form that is nearest."""
    rows = tuple((match.name, f"{match.score:.2f}", match.form) for match in matches)
    return Table(f"{len(rows)} candidates", ("name", "score", "nearest form"), rows).text()


def protocol_table(protocols: Iterable[Protocol]) -> str:
    """Return one line a protocol: id, name, type and counts."""
    rows = tuple(
        (p.id, p.name, p.reaction_type, str(len(p.reagents)), str(len(p.instruments)), str(len(p.steps)), str(p.moves))
        for p in protocols
    )
    columns = ("id", "name", "reaction type", "reagents", "instruments", "steps", "moves")
    return Table(f"{len(rows)} protocols", columns, rows).text()


def protocol_details(protocol: Protocol) -> str:
    """Return what a protocol makes, of what, with what and how."""
    reagents = [f"{r.name}" + (f" ({r.role}{', ' + r.amount if r.amount else ''})") for r in protocol.reagents]
    facts = [
        ("type", protocol.reaction_type.replace("_", " ")),
        ("reaction", protocol.reaction),
        ("product", protocol.product),
        ("reagents", ", ".join(reagents)),
        ("instruments", ", ".join(protocol.instruments)),
        ("route", " -> ".join(protocol.route)),
    ]
    steps = [f"  {step.index:>2}. {step.location}: {step.text}" for step in protocol.steps]
    return "\n".join([f"{protocol.id}  {protocol.name}", protocol.description, "", *_facts(facts), "", *steps])


def search_results(results: Results) -> str:
    """Return one line a fragment that was found: where it is from, its scores and how it begins."""
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
    heading = f"{len(rows)} fragments, {method}" if rows else f"nothing found, {method}"
    return Table(heading, ("source", "score", "BM25", "cosine", "fragment"), rows).text()


def experiment_table(experiments: Sequence[Experiment]) -> str:
    """Return one line an experiment: id, name, type and counts."""
    rows = tuple(
        (item.id, item.name, item.reaction_type or "-", str(len(item.materials)), str(len(item.actions)))
        for item in experiments
    )
    return Table(f"{len(rows)} experiments", ("id", "name", "reaction type", "materials", "actions"), rows).text()


def experiment_details(experiment: Experiment) -> str:
    """Return what an experiment makes, of what, and its actions."""
    catalog = Catalog.load()
    facts = [
        ("type", (experiment.reaction_type or "").replace("_", " ")),
        ("also called", ", ".join(experiment.synonyms)),
        ("reaction", experiment.reaction),
        ("product", experiment.product),
        ("materials", ", ".join(f"{item.name} ({item.role})" for item in experiment.materials)),
        ("licence", experiment.license),
    ]
    actions = [f"  {k:>2}. {sentence(action, catalog)}" for k, action in enumerate(experiment.actions, 1)]
    return "\n".join([f"{experiment.id}  {experiment.name}", experiment.description, "", *_facts(facts), "", *actions])


def verdict_table(verdicts: Sequence[Verdict]) -> str:
    """Return how many experiments are feasible, then each obstacle of the others on a line."""
    possible = sum(verdict.feasible for verdict in verdicts)
    rows = tuple(
        (verdict.experiment.id, obstacle.code, str(obstacle.action or "-"), obstacle.message)
        for verdict in verdicts
        for obstacle in verdict.obstacles
    )
    heading = f"{possible} of {len(verdicts)} experiments are feasible"
    return Table(heading, ("experiment", "obstacle", "action", "why"), rows).text() if rows else heading


def layout_score(report: LayoutReport) -> str:
    """Return a layout's metrics on one line each, then what is wrong with it and what could be better."""
    facts = [(heading, figure(getattr(report, key), digits)) for key, heading, digits in LAYOUT_COLUMNS]
    extra = [("v", str(report.v)), ("fitness", figure(report.fitness, 3)), ("S_phys", f"{report.s_phys:.1f} of 35")]
    extra += [("S_chem", f"{report.s_chem:.1f} of 35")] if report.s_chem is not None else []
    head = f"{report.layout}: {report.version}, profile {report.profile}, protocol {report.protocol or 'none'}"
    wrong = [f"violation: {item.message}; {item.suggestion}" for item in report.violations]
    missing = [f"missing: {', '.join(report.missing)}"] if report.missing else []
    better = [f"warning: {item.message} [{item.source}]" for item in report.warnings]
    return "\n".join(
        [head, "", *_facts(facts + extra), *([""] if wrong or missing or better else []), *missing, *wrong, *better]
    )


def _because(reaction: Reaction) -> str:
    sides = (reaction.first, reaction.second)
    return " with ".join(f"{_spaced(side.group)} ({side.asset})" for side in sides)


def _groups(reaction: Reaction, asset: Asset) -> str:
    """Return the other reagent's group and the asset's own."""
    sides = sorted((reaction.first, reaction.second), key=lambda side: side.asset == asset.name)
    return " with ".join(_spaced(side.group) for side in sides)


def _inferred(asset: Asset) -> list[str]:
    """Return a line that says how the groups of a reagent were inferred; none where they are the catalogue's."""
    chemistry = asset.chemistry
    if chemistry is None or not chemistry.notes.startswith(INFERRED):
        return []
    return [f"{asset.name} is {chemistry.smiles}, its groups {chemistry.notes.replace('_', ' ')}"]


def _spaced(group: str) -> str:
    return group.replace("_", " ")


def _facts(facts: Iterable[tuple[str, str]], width: int = 0) -> list[str]:
    present = [(name, value) for name, value in facts if value]
    width = max(width, *(len(name) for name, _ in present))
    return [f"{name:<{width}}  {value}" for name, value in present]


def _beginning(text: str, width: int = 90) -> str:
    return text if len(text) <= width else text[: width - 3] + "..."


def _size(asset: Asset) -> str:
    return f"{asset.size.width:g} x {asset.size.depth:g} x {asset.size.height:g}"


def _hazards(asset: Asset) -> list[str]:
    return [name.replace("_", " ") for name, value in asset.hazards if value]


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
