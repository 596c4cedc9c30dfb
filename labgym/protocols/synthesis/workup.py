"""From the end of the reaction to the pure product: quench, work-up, purification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.assets import Asset, Catalog
from labgym.protocols.synthesis.apparatus import BEAKERS, vessel_for
from labgym.protocols.synthesis.bench import HOOD, Bench
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.refusals import refusals
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, SOLVENTS, scaled
from labgym.protocols.synthesis.transformations import Transformation

ALUMINIUM_HYDRIDES = ("LithiumAluminumHydride", "DIBALH")
FUNNEL_FILL = 0.8
PURIFYING = ("Recrystallize", "Crystallize", "Chromatograph", "Distill", "DrySolid", "DryVacuum")
SOLID = ("Filter", "Recrystallize", "Crystallize")
WORKING_UP = ("Extract", "Wash", "Filter", "Concentrate", "DrySolution")
MAX_SCALE = 2.5
"""Work-up volumes grow with the batch up to this factor; beyond it more portions are taken than the text says."""


@dataclass(frozen=True)
class Task:
    """An operation after the reaction.

    Attributes:
        reagents: with amounts as written, "" where the text has none.
        temperature, duration: where the text gives them.
    """

    action: str
    reagents: tuple[tuple[Asset, str], ...] = ()
    temperature: float | None = None
    duration: float | None = None
    devices: tuple[str, ...] = ()

    def of(self, *categories: str) -> tuple[tuple[Asset, str], ...]:
        """Return the reagents of some categories."""
        return tuple(item for item in self.reagents if item[0].category in categories)


DOERS = {
    "Quench": "_quench",
    "Acidify": "_quench",
    "Basify": "_quench",
    "Extract": "_extract",
    "Wash": "_wash",
    "DrySolution": "_dry_solution",
    "Filter": "_filter",
    "Concentrate": "_concentrate",
    "Recrystallize": "_recrystallise",
    "Crystallize": "_crystallise",
    "Distill": "_distil",
    "Chromatograph": "_chromatograph",
    "DrySolid": "_dry_solid",
    "DryVacuum": "_dry_vacuum",
}


def tasks(kind: Transformation, clauses: Sequence[Clause], reagents: Sequence[Asset]) -> tuple[Task, ...]:
    """Return what the text says is done after the reaction, completed to a whole life cycle by the kind of reaction."""
    said = _settled([task for clause in clauses if (task := _said(clause)) is not None])
    usual = _usual(kind)
    if kind.action == "Distill" and said and said[0].action == "Distill":
        said = said[1:]
    actions = [task.action for task in said]
    collected = actions[:1] in (["Filter"], ["Concentrate"]) and not any(_lively(reagent) for reagent in reagents)
    if not collected and not any(action in ("Quench", "Acidify", "Basify") for action in actions):
        said = [*usual["quench"], *said]
    if _reducing(kind) and "Quench" not in actions and "Acidify" in actions:
        # Acid on what is left of an oxidiser, or on manganese dioxide, frees chlorine.
        said = [*usual["quench"], *usual["workup"][:1], *said]
    if not any(action in WORKING_UP for action in actions):
        at = next((i for i, task in enumerate(said) if task.action in PURIFYING), len(said))
        said = [*said[:at], *usual["workup"], *said[at:]]
    if not any(action in PURIFYING for action in actions):
        said = [*said, *usual["purify"]]
    if "Extract" in [task.action for task in said] and "Concentrate" not in [task.action for task in said]:
        at = max(i for i, task in enumerate(said) if task.action in ("Extract", "Wash", "DrySolution")) + 1
        said.insert(at, Task("Concentrate"))
    return tuple(said)


def _reducing(kind: Transformation) -> bool:
    """Say whether the reaction is ended by destroying an oxidiser."""
    return kind.quench is not None and kind.quench.asset in ("SodiumSulfite", "SodiumBisulfite", "SodiumThiosulfate")


def _settled(said: Sequence[Task]) -> list[Task]:
    """Return tasks with what follows a solid meant for the solid: it is rinsed on the filter, and dried in the oven."""
    settled: list[Task] = []
    for task in said:
        solid = bool(settled) and settled[-1].action in SOLID
        if solid and task.action == "DrySolution" and not task.reagents:
            task = replace(task, action="DrySolid")
        elif solid and task.action == "Wash":
            task = replace(task, action="Filter")
        settled.append(task)
    return settled


def _lively(reagent: Asset) -> bool:
    """Say whether what is left of a reagent has to be destroyed before the mixture is worked up."""
    chemistry = reagent.chemistry
    return reagent.hazards.oxidizer or (chemistry is not None and chemistry.water_reactive)


def _said(clause: Clause) -> Task | None:
    operation = clause.operation
    if operation is None or operation.action not in DOERS:
        return None
    catalog = Catalog.load()
    reagents = tuple((catalog.get(name), clause.amounts.get(name, "")) for name in clause.names("reagent"))
    if not reagents and "水洗" in clause.text:
        reagents = ((catalog.get("DeionizedWater"), ""),)
    return Task(operation.action, reagents, clause.temperature, clause.duration, clause.names("instrument"))


def _usual(kind: Transformation) -> dict[str, list[Task]]:
    catalog = Catalog.load()
    quench = []
    if kind.quench is not None:
        quench = [Task(kind.quench.action, ((catalog.get(kind.quench.asset), kind.quench.amount + ASSUMED),))]
    return {"quench": quench, "workup": [_parsed(text) for text in kind.workup], "purify": [_parsed(kind.purify)]}


def _parsed(text: str) -> Task:
    word, _, names = text.partition(":")
    reagents = tuple((Catalog.load().get(name), "") for name in names.split("+") if name)
    return Task(_WORDS[word], reagents)


_WORDS = {
    "extract": "Extract",
    "wash": "Wash",
    "dry": "DrySolution",
    "filter": "Filter",
    "acidify": "Acidify",
    "concentrate": "Concentrate",
    "recrystallise": "Recrystallize",
    "crystallise": "Crystallize",
    "chromatograph": "Chromatograph",
    "distil": "Distill",
    "vacuum": "DryVacuum",
}


def _words(names: Sequence[str]) -> str:
    return " and ".join(_spaced(name) for name in names) or "water"


def _dissolved(names: Sequence[str]) -> str:
    """Return what is poured in: solids as their solutions in water."""
    solids = {
        name for name in names if (chemistry := Catalog.load().get(name).chemistry) and chemistry.state == "solid"
    }
    return " and ".join(f"{_spaced(name)} solution" if name in solids else _spaced(name) for name in names) or "water"


def _spaced(name: str) -> str:
    asset = Catalog.load().get(name)
    return asset.synonyms_en[0].split(" (")[0] if asset.synonyms_en else name


class WorkUp:
    """Carries tasks out, step by step.

    Args:
        bench: what the steps are appended to.
        volume: of the reaction, mL. factor: how large the batch is beside the table's.
        vessel: that the reaction was in.
    """

    def __init__(self, bench: Bench, kind: Transformation, volume: float, factor: float, vessel: str) -> None:
        self.bench, self.kind, self.volume, self.vessel = bench, kind, volume, vessel
        self.factor = min(factor, MAX_SCALE)

    def carry_out(self, task: Task) -> None:
        """Append the steps of a task."""
        getattr(self, DOERS[task.action])(task)

    def _list(self, task: Task, role: str, amount: str, fallback: str = "") -> tuple[str, ...]:
        """List a task's reagents, or the fallback where it has none, and return their names."""
        given = task.reagents or (((Catalog.load().get(fallback), ""),) if fallback else ())
        return tuple(
            self.bench.take(asset, role, said or scaled(amount, self.factor) + ASSUMED) for asset, said in given
        )

    def _quench(self, task: Task) -> None:
        usual = self.kind.quench
        fallback = usual.asset if usual is not None else "SodiumBicarbonate" if task.action == "Quench" else ""
        fallback = fallback or {"Acidify": "HydrochloricAcid", "Basify": "SodiumHydroxide"}[task.action]
        chosen = [asset.name for asset, _ in task.reagents] or [fallback]
        spare = "40 mL" if task.action == "Quench" else "40 mL of 3 M aq."
        amount = usual.amount if usual is not None and chosen == [usual.asset] else spare
        role = {"Quench": "quench", "Acidify": "acidification", "Basify": "basification"}[task.action]
        names = self._list(task, role, amount, fallback)
        if task.action == "Quench" and any(self.bench.takes(name) for name in refusals().destroyed_by_protic):
            self._quench_hydride(names, task)
            return
        beaker = vessel_for(2.0 * self.volume + 60.0, BEAKERS, 0.95)
        texts = {
            "Quench": f"Pour the cold mixture slowly onto {_dissolved(names)} with ice and let gas escape.",
            "Acidify": f"Pour the mixture onto ice and acidify slowly with {_dissolved(names)}; check with pH paper.",
            "Basify": f"Pour the mixture onto ice and basify slowly with {_dissolved(names)}; check with pH paper.",
        }
        paper = ("PHPaper",) if task.action != "Quench" else ()
        at = task.temperature if task.temperature is not None and task.temperature <= 25.0 else 5.0
        self.bench.do(
            task.action,
            texts[task.action],
            (self.vessel, beaker, "IceBath", *paper, *names),
            HOOD,
            at,
            task.duration or 20.0,
        )

    def _quench_hydride(self, names: tuple[str, ...], task: Task) -> None:
        """Destroy what is left of a hydride or organometallic in its flask, drop by drop in the cold."""
        gas = tuple(name for name in PROTECTIVE_GASES if self.bench.takes(name))
        aluminium = any(self.bench.takes(name) for name in ALUMINIUM_HYDRIDES)
        after: tuple[str, ...] = ()
        if aluminium:
            after = tuple(
                self.bench.take(Catalog.load().get(name), "hydrolysis", amount)
                for name, amount in (("DeionizedWater", "3.5 mL"), ("SodiumHydroxide", "1.2 mL of 15 % aq."))
                if name not in names
            )
        words = ", then ".join(_dissolved([name]) for name in (*names, *after))
        shield = " under inert gas" if gas else ""
        text = f"Cool the flask in an ice bath and add {words} drop by drop{shield}; wait until no more gas comes."
        line = ("SchlenkLine", *gas) if gas else ()
        uses = (self.vessel, "IceBath", "DroppingFunnel", *line, *names, *after)
        self.bench.do("Quench", text, uses, HOOD, 5.0, task.duration or 30.0)

    def _extract(self, task: Task) -> None:
        solvents = Task(task.action, task.of(*SOLVENTS)) if task.of(*SOLVENTS) else Task(task.action)
        usual = next(
            (t.reagents[0][0].name for t in _usual(self.kind)["workup"] if t.action == "Extract"), "EthylAcetate"
        )
        names = self._list(solvents, "extraction solvent", "2 x 30 mL", usual)
        rest = tuple(
            self.bench.take(asset, "wash", said or f"30 mL{ASSUMED}")
            for asset, said in task.reagents
            if asset.name not in names
        )
        text = f"Transfer to the separating funnel, extract twice with {_words(names)} and combine the organic layers."
        self.bench.do(
            "Extract", text, ("SeparatoryFunnel", "ErlenmeyerFlask", *names, *rest), HOOD, 22.0, task.duration or 20.0
        )

    def _wash(self, task: Task) -> None:
        names = self._list(task, "wash", "30 mL aq.", "SodiumChloride")
        text = f"Wash the organic layer in the separating funnel with {_dissolved(names)}."
        self.bench.do("Wash", text, ("SeparatoryFunnel", "ErlenmeyerFlask", *names), HOOD, 22.0, task.duration or 15.0)

    def _dry_solution(self, task: Task) -> None:
        names = self._list(task, "drying agent", "5 g", "MagnesiumSulfate")
        text = f"Dry the organic layer over {_words(names)} in a conical flask and filter."
        self.bench.do(
            "DrySolution", text, ("ErlenmeyerFlask", "GlassFunnel", *names), HOOD, 22.0, task.duration or 15.0
        )

    def _filter(self, task: Task) -> None:
        aids = tuple(
            self.bench.take(asset, "filter aid", said or f"5 g{ASSUMED}") for asset, said in task.of("adsorbent")
        )
        rinses = tuple(self.bench.take(asset, "rinse", said or f"20 mL{ASSUMED}") for asset, said in task.of(*SOLVENTS))
        text = "Filter by suction" + (f" through {_words(aids)}" if aids else "")
        text += f", rinse with {_words(rinses)}" if rinses else ""
        at = task.temperature if task.temperature is not None and task.temperature < 25.0 else 22.0
        uses = ("BuchnerFunnel", "FilterFlask", "FilterPaper", *aids, *rinses)
        self.bench.do("Filter", f"{text} and keep what is wanted.", uses, HOOD, at, task.duration or 15.0)

    def _concentrate(self, task: Task) -> None:
        at = task.temperature if task.temperature is not None and task.temperature >= 25.0 else 40.0
        text = f"Evaporate the solvent under reduced pressure at a bath temperature of {at:g} C."
        flask = "RoundBottomFlask"
        self.bench.do(
            "Concentrate", text, ("RotaryEvaporator", flask), "RotaryEvaporatorStation", at, task.duration or 20.0
        )

    def _recrystallise(self, task: Task) -> None:
        usual = next(
            (t.reagents[0][0].name for t in _usual(self.kind)["purify"] if t.action == "Recrystallize"), "Ethanol"
        )
        names = self._list(task, "recrystallisation", "40 mL", usual)
        boiling = [
            chem.boiling_point for name in names if (chem := Catalog.load().get(name).chemistry) and chem.boiling_point
        ]
        hot = round(max(30.0, min(boiling, default=75.0) - 4.0), 1)
        uses = ("ErlenmeyerFlask", "MagneticHotplateStirrer", "BuchnerFunnel", "FilterFlask", *names)
        text = (
            f"Dissolve the product in hot {_words(names)}, let it cool, chill, filter by suction and let it dry in air."
        )
        self.bench.do("Recrystallize", text, uses, HOOD, hot, task.duration or 45.0)

    def _crystallise(self, task: Task) -> None:
        names = self._list(task, "crystallisation", "30 mL")
        cold = task.temperature if task.temperature is not None and 0.0 <= task.temperature < 20.0 else 3.0
        uses = ("CrystallizingDish", "IceBath", "BuchnerFunnel", "FilterFlask", *names)
        self.bench.do(
            "Crystallize",
            "Chill until the product crystallises, and collect it by suction.",
            uses,
            HOOD,
            cold,
            task.duration or 40.0,
        )

    def _distil(self, task: Task) -> None:
        at = task.temperature if task.temperature is not None and task.temperature > 30.0 else 90.0
        uses = ("RoundBottomFlask", "DistillationHead", "LiebigCondenser", "VacuumAdapter", "PearShapedFlask")
        text = f"Test for peroxides, then distil under reduced pressure from a bath at {at:g} C."
        self.bench.do(
            "Distill",
            text,
            (*uses, "VacuumPump", "OilBath", "MagneticHotplateStirrer"),
            HOOD,
            at,
            task.duration or 60.0,
        )

    def _chromatograph(self, task: Task) -> None:
        solvents = Task(task.action, task.of(*SOLVENTS))
        usual = next((t for t in _usual(self.kind)["purify"] if t.action == "Chromatograph"), None)
        if not solvents.reagents:
            solvents = usual if usual is not None else _parsed("chromatograph:NHexane+EthylAcetate")
        names = self._list(solvents, "eluent", "200 mL")
        silica = self.bench.take(
            Catalog.load().get("SilicaGel"), "stationary phase", scaled("40 g", self.factor) + ASSUMED
        )
        text = f"Run a column of silica gel with {_words(names)}; follow the fractions by TLC."
        uses = ("ChromatographyColumn", "TLCPlate", silica, *names)
        self.bench.do("Chromatograph", text, uses, "PurificationBench", 22.0, task.duration or 60.0)

    def _dry_solid(self, task: Task) -> None:
        oven = next((name for name in task.devices if name in ("VacuumOven", "DryingOven")), "DryingOven")
        at = task.temperature if task.temperature is not None and task.temperature > 30.0 else 50.0
        self.bench.do(
            "DrySolid",
            f"Dry the product at {at:g} C to constant mass.",
            (oven, "WatchGlass"),
            "DryingStation",
            at,
            task.duration or 60.0,
        )

    def _dry_vacuum(self, task: Task) -> None:
        text = "Hold the residue under vacuum, a cold trap before the pump, until its mass is constant."
        self.bench.do(
            "DryVacuum", text, ("RoundBottomFlask", "VacuumPump", "ColdTrap"), HOOD, 22.0, task.duration or 45.0
        )
