"""From the names of an experiment to its reagents: those of the catalog, and substances that the protocol embeds.

A name is looked up in the published table, then in the sources of `labgym.protocols.substances.sources`; the structure
of the record comes last. What nobody knows becomes an unclassified bottle.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

from labgym.assets import Catalog
from labgym.assets.flags import FLAGS, by_rule
from labgym.assets.inference.classify import classify
from labgym.assets.inference.prohibited import ProhibitedSubstanceError
from labgym.assets.model import Chemistry, Phase
from labgym.assets.qualifiers import of_substance
from labgym.assets.structures import canonical
from labgym.assets.substances import (
    UNKNOWN_FLAGS,
    ListedName,
    Source,
    Substance,
    entry_name,
    is_generic,
    listed_name,
)
from labgym.errors import LabgymError
from labgym.protocols.amounts import read_amount, scaled
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments.grounding import SOLVENTS, WATER, Grounder, grounded
from labgym.protocols.experiments.model import Experiment, Material, Portion
from labgym.protocols.refusals import is_ordinary_dinitro, refuse_structure
from labgym.protocols.substances.sources import database_structures, parsed_structures, physical_data

_LEADING = re.compile(
    r"^(?:(?:half[- ])?saturated|sat(?:'?d|\.)?|aqueous|aq\.?|concentrated|conc\.?|dilute|dil\.?|glacial|anhydrous|dry|"
    r"absolute|fresh(?:ly distilled)?|crude|pure|solid|powdered|ice[- ]cold|cold|hot|warm|boiling|excess|catalytic|"
    r"gaseous|liquid|melted|molten|methanolic|ethanolic|isopropanolic|ethereal|alcoholic|commercial|granular|activated|the|an?)\b[\s,]*",
    re.IGNORECASE,
)
_TRAILING = re.compile(
    r"(?<![\s,])[\s,]++(?:solution|gas|powder|pellets|dust|turnings|salt|catalyst|\(?aq\.?\)?)\s*$", re.IGNORECASE
)
_REMARK = re.compile(r"^(.*[^\s(])\s+\(([^()]*)\)$")
_STRENGTH = re.compile(r"^\s*\d+(?:\.\d+)?\s*(?:M|N|%|wt\s?%|mol/L)\s+(?:solution\s+of\s+)?(?=\D)")
_ISOMERS = re.compile(r"^\(?(?:E/Z|Z/E|cis/trans|trans/cis|all-cis|rac\.?|[dD],?[lL]|RS|±|\+/-)\)?-\s?")
"""Begin of the name of a mixture of stereoisomers."""
_THIO = re.compile(r"(?<=yl)thio(?=benz(?:o(?:yl|ic|ate|nitrile)|aldehyde))", re.IGNORECASE)
"""An alkylthio group before the name of an acid, which parsers read as a thio acid."""
_REPRINTED = (
    (re.compile(r"(?<=[)\]])\s(?=[a-z(\d])"), ""),
    (re.compile(r"(?<!cyclo)(?<!spiro)\[(\d)\.(\d)\](?=[a-z])"), r"[\1,\2]"),
    (re.compile(r"\btert\.-?\s?", re.IGNORECASE), "tert-"),
    (re.compile(r"\s(?=\((?:0|I{1,3}|IV|VI)\))"), ""),
    (re.compile("[\u2032\u2019]"), "'"),
    (re.compile(r"sulph(?=[aeio])", re.IGNORECASE), "sulf"),
    (re.compile(r"(?<=benzene) (?=sul(?:f|ph)onyl|boronic)"), ""),
    (re.compile(r"(?<=-)l(?=\(\dH\))"), "1"),
    (re.compile(r"(?<=\d),(?=[a-z]\])"), "-"),
    (re.compile(r"imidazol(?=\[)"), "imidazo"),
    (re.compile(r"-?\[(\d)\.(?=\d-[a-z]\])"), r"[\1,"),
    (re.compile(r"(?<=-\d-)ine\b"), "yne"),
    (re.compile(r"(?<![\d,'])(\d{1,2})-\(([RS])\)-"), r"(\1\2)-\1-"),
    (re.compile(r"(?<![\d,])(\d)-H-(?=[a-z])"), r"\1H-"),
    (re.compile(r"[.·]\s?HCl$"), " hydrochloride"),
    (re.compile(r"[.·]\s?2\s?HCl$"), " dihydrochloride"),
    (re.compile(r"\bN,N1 ?(?=-)"), "N,N'"),
    (re.compile(r"(?<=\[\d')(?=\d')"), ","),
    (re.compile(r"\bpott?ass?ium\b", re.IGNORECASE), "potassium"),
    (re.compile(r" boron hydride$", re.IGNORECASE), " borohydride"),
    (re.compile(r"(?<=-)ethinyl\b"), "ethynyl"),
    (re.compile(r"(?<=[\[(])[Il](?=-\()"), "1"),
    (re.compile(r"arnine\b"), "amine"),
    (re.compile(r",? (?:syn|anti|cis|trans|[EZ])[- ]isomer$"), ""),
    (re.compile(r"^(sodium|potassium|calcium) ([a-z]+in)$", re.IGNORECASE), r"\2 \1"),
)
"""Slips of printed names with their systematic spelling: "[1.4]benzoxazine", "tert.butyl", "amine.HCl"."""
_MORPHEMES = (
    "aluminum", "benzylidene", "benzyloxy", "bromide", "carbodiimide", "carbonyl", "carboxy", "carboxylic",
    "chloride", "chloro", "cyclohex", "cyclopent", "disilazide", "fluoride", "fluoro", "hydrochlor", "hydroxy",
    "imidazol", "methoxy", "methylsilyl", "methylthio", "morpholin", "phenoxy", "piperazin", "piperidin",
    "pyrrolidin", "silyloxy",
)  # fmt: skip
"""Parts of names of which misprints with a letter that is left out, doubled or swapped with the next are known."""
_LABEL = re.compile(
    r"(?:the\s++)?(?:(?:title|crude|above|resulting|resultant|desired|said|obtained|corresponding|final)\s++)*"
    r"(?:compounds?|intermediates?|products?|examples?|steps?|preparations?|material|residue|mixture|solution|solids?|"
    r"oil|filtrate|precipitate|foam|crystals?)?[\s([]*+(?:\d{1,4}(?:\.\d{1,3})?[\s([]*+[a-z]?|[ivx]{1,5}|[a-z])?[\s)\].]*",
    re.IGNORECASE,
)
"""Names that point to another place of a text: "crude product", "compound 12a", "(iv)"."""
_OXY = re.compile(
    r"(?<=[a-z]oxy)[ -](?=(?:acet|benzo|propan|propion|butan|butyr)\w{0,5}(?:ate|ic acid|amide|nitrile)\b)"
)
"""A space within the name of an ether of an acid, which parsers read as a peroxide: "phenoxy acetate"."""
MAX_FORMS = 6
PLACEHOLDER = "unnamed "
"""Begin of the name of a substance that is only known by its class."""
_NUMBER = r"(\d{1,3}(?:\.\d{1,2})?)"
_RATIO = re.compile(rf"(?<![\s(\[])[\s(\[]*+(?<![\d.]){_NUMBER}\s*[:/]\s*{_NUMBER}(?:\s*+,?\s*+\(?v/v\)?)?[)\]\s]*$")
_JOINTS = re.compile(r"[\s/:+\u2013\u2014-]+(?:and\s+)?")
MAX_WORDS = 6
"""Most words of a mixture of two solvents."""


@dataclass(frozen=True)
class Resolution:
    """The meaning of a name.

    Attributes:
        name: as written.
        asset: name of the catalog's reagent, or "".
        smiles: canonical structure, or "".
        source: what named the structure.
        listed: its entry of the published table.
        parts: the assets of a mixture of solvents with their shares of the volume, if it is one.
        others: structures that other sources give to the name, canonical.
    """

    name: str
    asset: str = ""
    smiles: str = ""
    source: Source = "none"
    listed: ListedName | None = None
    parts: tuple[tuple[str, float], ...] = ()
    others: tuple[tuple[Source, str], ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether it is an asset, a structure, a listed mixture or a mixture of assets."""
        return bool(self.asset or self.smiles or self.listed or self.parts)

    @property
    def is_disputed(self) -> bool:
        """Whether sources give different structures, stereochemistry aside."""
        return any(_flat(smiles) != _flat(self.smiles) for _, smiles in self.others)


@dataclass(frozen=True)
class OpenedExperiment:
    """An experiment whose materials all have an entry.

    Attributes:
        experiment: with the names of assets and substances.
        substances: that the protocol embeds, by name.
        partial: what of the chemistry is not known, one sentence each.
        resolutions: what each name means.
    """

    experiment: Experiment
    substances: tuple[Substance, ...] = ()
    partial: tuple[str, ...] = ()
    resolutions: tuple[Resolution, ...] = ()


class Resolver:
    """Says what names mean. Each source is asked once for all names of a call.

    Args:
        catalog: whose reagents come first.
        databases, parser: whether the optional sources are asked.
    """

    def __init__(self, catalog: Catalog, databases: bool = True, parser: bool = True) -> None:
        self.catalog = catalog
        self._databases, self._parser = databases, parser

    @cached_property
    def _grounder(self) -> Grounder:
        return Grounder(self.catalog)

    def resolve(self, materials: Iterable[Material]) -> tuple[Resolution, ...]:
        """Return what the names of materials mean, in their order."""
        several = tuple(materials)
        first = {material: self._first(material) for material in several}
        open_ = {material: tuple(forms(material.name)) for material, known in first.items() if not known.is_known}
        names = {form for candidates in open_.values() for form in candidates}
        database = database_structures(names) if self._databases else {}
        parsed = parsed_structures(names) if self._parser else {}
        return tuple(
            self._chosen(material, open_[material], database, parsed) if material in open_ else first[material]
            for material in several
        )

    def _first(self, material: Material) -> Resolution:
        """Return the reagent of the catalog or the entry of the table that a material is, if any."""
        asset = self._grounder.find(material)
        if asset is not None:
            return Resolution(material.name, asset=asset)
        for form in forms(material.name):
            entry = listed_name(form)
            if entry is None:
                continue
            if entry.asset:
                return Resolution(material.name, asset=entry.asset, listed=entry)
            smiles = canonical(entry.smiles) if entry.smiles else ""
            record = _readable(material.smiles)
            others: tuple[tuple[Source, str], ...] = (("record", record),) if record and smiles else ()
            return self._known(Resolution(material.name, smiles=smiles, source="table", listed=entry, others=others))
        return Resolution(material.name, parts=self._mixture(material.name))

    def _mixture(self, name: str) -> tuple[tuple[str, float], ...]:
        """Return the solvents of "ethyl acetate/hexane (1:2)" or "ethanol pentane" with their shares, or nothing.

        Solvents without a ratio have equal shares.
        """
        stated = _RATIO.search(name)
        words = [word for word in _JOINTS.split(_RATIO.sub("", name)) if word]
        if not 2 <= len(words) <= MAX_WORDS:
            return ()
        for cut in range(1, len(words)):
            pair = [self._solvent(" ".join(words[:cut])), self._solvent(" ".join(words[cut:]))]
            if all(pair) and pair[0] != pair[1]:
                ratio = [float(stated[1]), float(stated[2])] if stated else [1.0, 1.0]
                total = sum(ratio)
                return tuple((str(asset), part / total) for asset, part in zip(pair, ratio, strict=True) if total)
        return ()

    def _solvent(self, name: str) -> str | None:
        entry = listed_name(name)
        asset = entry.asset if entry is not None else self._grounder.find(Material(name=name, role="solvent"))
        category = self.catalog.get(asset).category if asset else ""
        return asset if asset and (category in SOLVENTS or asset == WATER) else None

    def _chosen(
        self, material: Material, candidates: Sequence[str], database: dict[str, str], parsed: dict[str, str]
    ) -> Resolution:
        structures: list[tuple[Source, str]] = []
        readings: tuple[tuple[Source, dict[str, str]], ...] = (("chemicals", database), ("opsin", parsed))
        for source, known in readings:
            smiles = next((text for form in candidates if (text := _readable(known.get(form, "")))), "")
            structures += [(source, smiles)] if smiles else []
        record = _readable(material.smiles)
        structures += [("record", record)] if record else []
        if not structures:
            return Resolution(material.name)
        # Two sources outvote one; otherwise the first has it.
        flat = [_flat(smiles) for _, smiles in structures]
        first = max(range(len(flat)), key=lambda place: (flat.count(flat[place]), -place))
        source, smiles = structures[first]
        return self._known(
            Resolution(
                material.name,
                smiles=smiles,
                source=source,
                others=tuple(item for place, item in enumerate(structures) if place != first),
            )
        )

    def _known(self, resolution: Resolution) -> Resolution:
        """Return a resolution with the catalog's reagent of its structure, if there is one."""
        asset = self._grounder.find(Material(name="?", role="reagent", smiles=resolution.smiles))
        return replace(resolution, asset=asset) if asset is not None else resolution


def forms(name: str) -> Iterator[str]:
    """Yield readings of a name, the most literal first: without strengths, grades, remarks. At most `MAX_FORMS`.

    Words for a kind or a place, such as "product", have none.
    """
    text = _OXY.sub("", _THIO.sub("sulfanyl", " ".join(name.split())))
    if is_generic(text) or _LABEL.fullmatch(text) or text.startswith(PLACEHOLDER):
        return
    seen: dict[str, None] = {}
    waiting = [text, of_substance(text)[1].name, _reprinted(text)]
    while waiting and len(seen) < MAX_FORMS:
        form = waiting.pop(0).strip(" ,;")
        if len(form) < 2 or form in seen or is_generic(form) or _LABEL.fullmatch(form):
            continue
        seen[form] = None
        remark = _REMARK.match(form)
        waiting += [_LEADING.sub("", form), _ISOMERS.sub("", form), _STRENGTH.sub("", form), _TRAILING.sub("", form)]
        waiting += [remark[1], remark[2]] if remark else []
    yield from seen


def _reprinted(name: str) -> str:
    for pattern, spelling in _REPRINTED:
        name = pattern.sub(spelling, name)
    misprints, pattern = _misprints()
    return pattern.sub(lambda match: misprints[match[0].lower()], name)


@lru_cache(maxsize=1)
def _misprints() -> tuple[dict[str, str], re.Pattern[str]]:
    """Return the misprints of parts of names with their spelling, and the pattern that finds them."""
    found: dict[str, str] = {}
    for part in _MORPHEMES:
        inner = range(1, len(part) - 1)
        wrong = {part[:k] + part[k + 1 :] for k in inner} | {part[: k + 1] + part[k:] for k in inner}
        wrong |= {part[:k] + part[k + 1] + part[k] + part[k + 2 :] for k in inner}
        found |= {word: part for word in wrong if not any(word in other for other in _MORPHEMES)}
    return found, re.compile("|".join(sorted(found, key=len, reverse=True)), re.IGNORECASE)


def opened(experiment: Experiment, resolver: Resolver) -> OpenedExperiment:
    """Return an experiment with an entry for each of its materials.

    Raises:
        RefusalError: a material is a chemical weapon or another substance that no protocol may handle.
    """
    catalog = resolver.catalog
    resolutions = resolver.resolve(experiment.materials)
    mixed = {resolution.name: resolution.parts for resolution in resolutions if resolution.parts}
    if mixed:
        experiment = _unmixed(experiment, mixed)
        resolutions = resolver.resolve(experiment.materials)
    names: dict[str, str] = {}
    substances: dict[str, Substance] = {}
    partial = []
    for material, resolution in zip(experiment.materials, resolutions, strict=True):
        if resolution.asset:
            names[material.name] = resolution.asset
            continue
        same = next((s for s in substances.values() if resolution.smiles and s.smiles == resolution.smiles), None)
        if same is None:
            taken = {*catalog.names, *substances}
            same = _substance(material, resolution, _state_in(experiment, material.name), catalog, taken)
            substances[same.name] = same
        names[material.name] = same.name
        if not same.is_classified and material.role not in ("solvent", "workup"):
            partial.append(f"the structure of {material.role} {material.name[:80]!r} is not known: give its SMILES")
    materials = tuple(material.model_copy(update={"smiles": ""}) for material in experiment.materials)
    return OpenedExperiment(
        experiment=grounded(experiment.model_copy(update={"materials": materials}), names),
        substances=tuple(substances.values()),
        partial=tuple(partial),
        resolutions=resolutions,
    )


def _unmixed(experiment: Experiment, mixed: Mapping[str, tuple[tuple[str, float], ...]]) -> Experiment:
    """Return an experiment with mixtures of solvents replaced by their parts, each with its share of the volume."""
    materials: dict[str, Material] = {}
    for material in experiment.materials:
        for name in [name for name, _ in mixed.get(material.name, ())] or [material.name]:
            materials.setdefault(name, material.model_copy(update={"name": name}))
            if material.name in mixed:
                materials[name] = materials[name].model_copy(update={"smiles": ""})
    actions = []
    for action in experiment.actions:
        takes = [part for portion in action.takes for part in _divided(portion, mixed.get(portion.name, ()))]
        actions.append(action.model_copy(update={"takes": tuple(takes)}))
    return experiment.model_copy(update={"materials": tuple(materials.values()), "actions": tuple(actions)})


def _divided(portion: Portion, parts: tuple[tuple[str, float], ...]) -> Iterator[Portion]:
    if not parts:
        yield portion
    for name, share in parts:
        yield portion.model_copy(update={"name": name, "amount": scaled(portion.amount, share)})


def _substance(
    material: Material, resolution: Resolution, hint: Phase | None, catalog: Catalog, taken: set[str]
) -> Substance:
    """Return the substance that a protocol embeds for a material."""
    title = material.name
    names = tuple(name for name in (title,) if catalog.match(name) is None) or (f"{title[:190]} (open)",)
    name = entry_name(title, taken)
    listed = resolution.listed
    if listed is not None and listed.traits is not None:
        traits = {field: getattr(listed.traits, field) for field in type(listed.traits).model_fields}
        return Substance(name=name, names=names, source="table", confidence="medium", notes=listed.note, **traits)
    if not resolution.smiles:
        return Substance(name=name, names=names, source="none", state=hint or "solid", flags=UNKNOWN_FLAGS)
    smiles = resolution.smiles
    if (listed is None or not listed.sold) and not is_ordinary_dinitro(smiles):
        refuse_structure(smiles)
    data = physical_data(smiles)
    stated = listed.state if listed is not None else None
    try:
        inference = classify(smiles, stated or data.state or hint)
        rivals = [classify(other) for _, other in resolution.others if resolution.is_disputed]
    except ProhibitedSubstanceError as error:
        raise RefusalError("unsafe", str(error)) from None
    chemistry = Chemistry(
        state=inference.state,
        boiling_point=data.boiling_point if not inference.measured else inference.boiling_point,
        flash_point=data.flash_point,
        density=data.density if inference.state == "liquid" else None,
        groups=tuple(inference.groups),
        storage_class=inference.storage_class,
    )
    flags = {flag for flag, holds in by_rule(chemistry).items() if holds}.union(inference.flags)
    flags.update(flag for rival in rivals for flag in rival.flags)
    reasons = "; ".join(f"{group}: {why[0].why}" for group, why in inference.groups.items())
    others = [f"{source} reads it as {other}" for source, other in resolution.others]
    disputed = others if resolution.is_disputed else []
    return Substance(
        name=name,
        names=names,
        smiles=inference.smiles,
        formula=inference.formula[:200],
        molar_mass=inference.molar_mass,
        state=inference.state,
        density=chemistry.density,
        boiling_point=chemistry.boiling_point,
        flash_point=chemistry.flash_point,
        flags=tuple(flag for flag in FLAGS if flag in flags),
        groups=chemistry.groups,
        source=resolution.source,
        confidence="low" if resolution.is_disputed else "medium",
        notes="; ".join([*disputed, *data.sources, *filter(None, (reasons,))])[:1000],
    )


def _state_in(experiment: Experiment, name: str) -> Phase | None:
    """Return the state of a material by its amounts: what is poured by volume is a liquid, what is weighed a solid."""
    weighed = False
    for action in experiment.actions:
        for portion in action.takes:
            if portion.name != name:
                continue
            amount = read_amount(portion.amount)
            dissolved = portion.solvent or amount.molarity is not None or amount.percent is not None
            if amount.volume is not None and not dissolved:
                return "liquid"
            weighed = weighed or amount.mass is not None
    return "solid" if weighed else None


def _readable(smiles: str) -> str:
    """Return the canonical form of a SMILES, or "" if it cannot be read."""
    try:
        return canonical(smiles) if smiles else ""
    except LabgymError:
        return ""


def _flat(smiles: str) -> str:
    """Return a canonical SMILES without stereochemistry."""
    plain = re.sub(r"\[(C|N|S|P)@+H?\d?\]", r"\1", smiles).replace("/", "").replace("\\", "")
    return _readable(plain) or smiles
