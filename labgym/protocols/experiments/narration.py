"""Experiments in plain English: one sentence per action."""

from __future__ import annotations

from labgym.assets import Catalog
from labgym.protocols.experiments.model import Action, Experiment, Portion, Verb

_PHRASES: dict[Verb, str] = {
    "Add": "Add",
    "AdjustPH": "Adjust the pH with",
    "Analyze": "Analyse the product",
    "Chromatograph": "Chromatograph on a column with",
    "CollectLayer": "Collect the layer",
    "Concentrate": "Evaporate the solvent",
    "Cool": "Cool",
    "Crystallize": "Let crystallise",
    "Dissolve": "Dissolve in",
    "Distill": "Distil",
    "DrySolid": "Dry the solid",
    "DrySolution": "Dry the solution over",
    "Extract": "Extract with",
    "Filter": "Filter",
    "Heat": "Heat",
    "Hydrogenate": "Hydrogenate",
    "Irradiate": "Irradiate",
    "MakeSolution": "Make a solution of",
    "Microwave": "Heat in the microwave reactor",
    "Monitor": "Check the reaction",
    "Note": "Carry out a step that no verb expresses",
    "Partition": "Partition between",
    "PhaseSeparation": "Separate the layers",
    "Pour": "Pour the mixture onto",
    "Purge": "Purge",
    "Purify": "Purify",
    "Quench": "Quench with",
    "Recrystallize": "Recrystallise from",
    "Refers": "Follow another procedure",
    "Reflux": "Reflux",
    "Repeat": "Repeat",
    "SetTemperature": "Bring",
    "Sonicate": "Sonicate",
    "Stir": "Stir",
    "Sublime": "Sublime",
    "Transfer": "Transfer",
    "Triturate": "Triturate with",
    "Wait": "Leave to stand",
    "Wash": "Wash with",
    "Yield": "Collect the product",
}
_OBJECTLESS: dict[Verb, str] = {
    "Chromatograph": "Chromatograph on a column",
    "Dissolve": "Dissolve",
    "DrySolution": "Dry the solution",
    "Extract": "Extract",
    "Wash": "Wash",
    "Quench": "Quench",
    "Recrystallize": "Recrystallise",
    "Triturate": "Triturate",
    "AdjustPH": "Adjust the pH",
    "Partition": "Partition",
    "Pour": "Pour the mixture out",
    "MakeSolution": "Make a solution",
}


def sentence(action: Action, catalog: Catalog) -> str:
    """Return an action as a sentence: "Add acetyl chloride (3.9 g, 50 mmol) dropwise at 0 C for 15 min."."""
    words = [(_PHRASES if action.takes else {**_PHRASES, **_OBJECTLESS})[action.verb]]
    if action.takes:
        words.append(_listed([_portion(portion, catalog) for portion in action.takes]))
    words += [action.manner] if action.manner else []
    words += [f"under {action.atmosphere}"] if action.atmosphere else []
    if action.temperature is not None:
        words.append(f"{'to' if action.verb in ('SetTemperature', 'Cool') else 'at'} {action.temperature:g} C")
    words += [f"to pH {action.ph:g}"] if action.ph is not None else []
    words += [f"at {action.pressure:.3g} bar"] if action.pressure is not None else []
    words += [f"for {action.duration:g} min"] if action.duration else []
    words += [f"and keep the {_fraction(action.keep)}"] if action.keep else []
    text = " ".join(words)
    return f"{text}; {action.note.rstrip('.')}." if action.note else f"{text}."


def narrate(experiment: Experiment, catalog: Catalog) -> str:
    """Return all actions of an experiment, one sentence each."""
    return " ".join(sentence(action, catalog) for action in experiment.actions)


def common_name(name: str, catalog: Catalog) -> str:
    """Return a material's common name: the first English synonym in the catalog, else the name unchanged."""
    if name not in catalog:
        return name
    synonyms = catalog.get(name).synonyms_en
    return synonyms[0] if synonyms else name


def _portion(portion: Portion, catalog: Catalog) -> str:
    name = common_name(portion.name, catalog)
    return f"{name} ({portion.amount})" if portion.amount else name


def _listed(items: list[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def _fraction(part: str) -> str:
    return f"{part} layer" if part in ("organic", "aqueous") else part
