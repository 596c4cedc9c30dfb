"""Apparatus: kinds of devices, place and usual conditions of each action; vessels by volume, baths by temperature.

`APPARATUS` is the only table from actions to devices. The feasibility filter asks it what the catalog must hold, and
everything that writes protocols (`labgym.protocols.synthesis`) takes the devices of its steps from it. A name stands
for all sizes of the asset; `labgym.protocols.sizing` chooses one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import read_amount, volume_of
from labgym.protocols.capability import capacity
from labgym.protocols.errors import RefusalError
from labgym.quantities import ROOM_RANGE, ROOM_TEMPERATURE

HOOD = "FumeHood"
FILL = 0.6
"""Largest share of a vessel that a reaction mixture may fill."""
REACTION_VESSELS = MappingProxyType({"RoundBottomFlask": 1000.0, "ThreeNeckFlask": 5000.0, "JacketedReactor": math.inf})
"""Kinds of vessels for reactions with the largest size that is used, mL: larger ones are stirred from above through a
separate neck, and no mantle heats flasks above 5 L. Where two sizes are equal, the first kind is taken."""
NECKED_VESSELS = ("ThreeNeckFlask", "JacketedReactor")
"""Kinds of vessels with necks for additions and a gas."""
USUAL_MINUTES = 15.0
"""Default duration of an action for which `APPARATUS` gives none."""
_SLOT = re.compile(r"\{([a-z]+)\}")


@dataclass(frozen=True)
class Apparatus:
    """The usual devices, place and conditions of an action.

    Attributes:
        devices: asset names of the kinds in the order in which a step lists them; "{vessel}" is a slot that `fill`
            replaces.
        place: asset name of the location.
        minutes: usual duration.
        temperature: usual temperature, degrees Celsius; None if it depends on the mixture.
        needs: sets of assets; the catalog must hold one of each set for the action to be feasible. Basic glassware,
            which every laboratory has, is not listed.
    """

    devices: tuple[str, ...] = ()
    place: str = HOOD
    minutes: float = USUAL_MINUTES
    temperature: float | None = None
    needs: tuple[frozenset[str], ...] = ()

    def fill(self, **slots: Sequence[str]) -> tuple[str, ...]:
        """Return the devices with each slot replaced by the names given for it, or by nothing."""
        names: list[str] = []
        for device in self.devices:
            slot = _SLOT.fullmatch(device)
            names += slots.get(slot[1], ()) if slot else [device]
        return tuple(names)


def _any(*names: str) -> frozenset[str]:
    return frozenset(names)


FUNNEL = ("SeparatoryFunnel", "ErlenmeyerFlask")
SUCTION = ("BuchnerFunnel", "FilterFlask", "FilterPaper")
IN_FLASK = ("{vessel}", "{device}", "{bath}", "{gas}", "{funnel}", "{condenser}", "{extras}")
"""The reaction mixture in its flask: stirred, heated, cooled, or added to."""
QUENCH = ("{vessel}", "{beaker}", "{bath}", "{funnel}", "{paper}", "{gas}")
_STIRRER = _any("MagneticStirrer", "MagneticHotplateStirrer", "OverheadStirrer", "OrbitalShaker")
_COLUMN = _any("ChromatographyColumn", "FlashChromatographySystem")
_SEPARATION = (_any("SeparatoryFunnel"),)
_FUNNEL = _any("BuchnerFunnel", "FrittedFunnel", "GlassFunnel")

APPARATUS = MappingProxyType(
    {
        "Acidify": Apparatus(QUENCH, minutes=20.0, temperature=5.0, needs=(_any("PHPaper", "PHMeter"),)),
        "Add": Apparatus(IN_FLASK),
        "AdjustPH": Apparatus(QUENCH, minutes=20.0, temperature=5.0, needs=(_any("PHPaper", "PHMeter"),)),
        "Analyze": Apparatus(("{device}",), "ValidationPlatform", minutes=20.0),
        "Basify": Apparatus(QUENCH, minutes=20.0, temperature=5.0, needs=(_any("PHPaper", "PHMeter"),)),
        "Chromatograph": Apparatus(
            ("ChromatographyColumn", "TLCPlate"), "PurificationBench", minutes=60.0, needs=(_COLUMN,)
        ),
        "Clean": Apparatus((), "SinkBench", minutes=20.0),
        "CollectLayer": Apparatus(FUNNEL, needs=_SEPARATION),
        "Concentrate": Apparatus(
            ("RotaryEvaporator", "RoundBottomFlask"),
            "RotaryEvaporatorStation",
            minutes=20.0,
            temperature=40.0,
            needs=(_any("RotaryEvaporator"),),
        ),
        "Cool": Apparatus(IN_FLASK),
        "Crystallize": Apparatus(("CrystallizingDish", "{bath}", "{suction}"), minutes=40.0, temperature=3.0),
        "Dissolve": Apparatus(IN_FLASK),
        "Distill": Apparatus(
            ("{vessel}", "DistillationHead", "LiebigCondenser", "VacuumAdapter", "PearShapedFlask", "{pump}", "{bath}"),
            minutes=60.0,
            temperature=90.0,
            needs=(_any("DistillationHead"), _any("LiebigCondenser")),
        ),
        "DrySolid": Apparatus(
            ("{oven}", "WatchGlass"),
            "DryingStation",
            minutes=60.0,
            temperature=40.0,
            needs=(_any("DryingOven", "VacuumOven", "Desiccator"),),
        ),
        "DrySolution": Apparatus(("ErlenmeyerFlask", "GlassFunnel")),
        "DryVacuum": Apparatus(("RoundBottomFlask", "VacuumPump", "ColdTrap"), minutes=45.0),
        "Extract": Apparatus(FUNNEL, minutes=20.0, needs=_SEPARATION),
        "Filter": Apparatus((*SUCTION, "{bath}"), needs=(_FUNNEL,)),
        "Heat": Apparatus(IN_FLASK),
        "Hydrogenate": Apparatus(
            ("{device}", "{vessel}", "{bath}"),
            needs=(_any("HydrogenationApparatus", "HydrogenBalloon", "PressureReactor"),),
        ),
        "Irradiate": Apparatus(("{vessel}", "PhotoReactor", "{gas}"), needs=(_any("PhotoReactor"),)),
        "MakeSolution": Apparatus(IN_FLASK, minutes=10.0),
        "Measure": Apparatus(("{vessel}",), "PreparationBench", minutes=10.0),
        "Microwave": Apparatus(("{vessel}", "MicrowaveReactor", "{gas}"), needs=(_any("MicrowaveReactor"),)),
        "Monitor": Apparatus(("TLCPlate", "TLCChamber"), minutes=10.0),
        "Partition": Apparatus(FUNNEL, needs=_SEPARATION),
        "PhaseSeparation": Apparatus(FUNNEL, needs=_SEPARATION),
        "Pour": Apparatus(QUENCH, temperature=5.0),
        "Purge": Apparatus(("{vessel}", "{gas}"), minutes=10.0),
        "Purify": Apparatus(("ChromatographyColumn", "TLCPlate"), "PurificationBench", minutes=60.0, needs=(_COLUMN,)),
        "Quench": Apparatus(QUENCH, minutes=20.0, temperature=5.0),
        "Recrystallize": Apparatus(
            ("{vessel}", "MagneticHotplateStirrer", "IceBath", "BuchnerFunnel", "FilterFlask"),
            minutes=45.0,
            temperature=60.0,
            needs=(_any("ErlenmeyerFlask", "RoundBottomFlask", "Beaker", "LargeBeaker"), _FUNNEL),
        ),
        "Reflux": Apparatus(IN_FLASK, temperature=80.0, needs=(_any("RefluxCondenser"),)),
        "SetTemperature": Apparatus(IN_FLASK),
        "Sonicate": Apparatus(("{vessel}", "UltrasonicCleaner", "{gas}"), needs=(_any("UltrasonicCleaner"),)),
        "Stir": Apparatus(IN_FLASK, minutes=30.0, needs=(_STIRRER,)),
        "Sublime": Apparatus(IN_FLASK, needs=(_any("SublimationApparatus"),)),
        "Triturate": Apparatus(IN_FLASK),
        "Wait": Apparatus(IN_FLASK),
        "Wash": Apparatus((*FUNNEL, "{bath}")),
        "Weigh": Apparatus(("ElectronicScale",), "PreparationBench", minutes=10.0),
        "WeighDry": Apparatus(("SampleVial",), "GloveBox", minutes=15.0),
    }
)
"""The apparatus of each action. "WeighDry" is the action "Weigh" without air and moisture."""


def usual_temperature(action: str) -> float:
    """Return the usual temperature of an action, degrees Celsius; room temperature if it depends on the mixture."""
    temperature = APPARATUS[action].temperature
    return ROOM_TEMPERATURE if temperature is None else temperature


def millilitres(reagents: Iterable[tuple[Asset, str]]) -> float:
    """Return the volume in mL of reagents by their amounts, portions and ice included."""
    total = 0.0
    for asset, text in reagents:
        amount = read_amount(text)
        total += volume_of(asset, amount) * amount.portions
    return total


def vessel_for(volume: float, catalog: Catalog, kinds: Iterable[str] = REACTION_VESSELS, fill: float = FILL) -> str:
    """Return the smallest vessel of some kinds that a volume fills to at most a given share.

    Args:
        volume: mL.
        catalog: the assets that know their capacity and sizes.
        kinds: asset names; all sizes of each count.
        fill: largest share of the capacity.

    Raises:
        RefusalError: every vessel is too small.
    """
    sizes = [(order, asset) for order, kind in enumerate(kinds) if kind in catalog for asset in catalog.sizes(kind)]
    known = [(capacity(asset) or 0.0, order, asset) for order, asset in sizes]
    fitting = [
        (holds, order, asset.name)
        for holds, order, asset in known
        if volume <= fill * holds and holds <= REACTION_VESSELS.get(asset.family, math.inf)
    ]
    if not fitting:
        what = f"a batch of {volume / 1000:.3g} L is too large for every vessel of the catalog"
        raise RefusalError("infeasible", what)
    return min(fitting)[2]


def bath_for(temperature: float | None) -> tuple[str, ...]:
    """Return the devices, including the stirrer, that bring a stirred vessel to a temperature in degrees Celsius.

    Raises:
        RefusalError: no bath reaches the temperature.
    """
    if temperature is None or ROOM_RANGE[0] <= temperature <= ROOM_RANGE[1]:
        return ("MagneticStirrer",)
    for limit, devices in (
        (-78.5, None),
        (-40.0, ("CoolingBathDewar", "MagneticStirrer")),
        (-15.0, ("LowTemperatureBath", "MagneticStirrer")),
        (ROOM_RANGE[0], ("IceBath", "MagneticStirrer")),
        (170.0, ("OilBath", "MagneticHotplateStirrer")),
        (290.0, ("SandBath", "OverheadStirrer")),
    ):
        if temperature < limit or (limit > ROOM_RANGE[1] and temperature <= limit):
            if devices is None:
                break
            return devices
    raise RefusalError("infeasible", f"no bath reaches {temperature:g} C; the baths cover -78 C to 290 C")
