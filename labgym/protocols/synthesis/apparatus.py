"""What a step is done in and with: vessels by volume, baths by temperature."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import read_amount, volume_of
from labgym.protocols.capability import capacity
from labgym.protocols.synthesis.errors import RefusalError

FILL = 0.6
"""Share of a vessel that a reaction may fill."""
FLASKS = ("RoundBottomFlask", "ThreeNeckFlask", "JacketedReactor")
BEAKERS = ("Beaker", "LargeBeaker", "JacketedReactor")
ROOM = (15.0, 30.0)
"""Temperatures, degrees Celsius, between which nothing is heated or cooled."""


def millilitres(reagents: Iterable[tuple[Asset, str]]) -> float:
    """Return the volume of reagents by their amounts, portions and ice included."""
    total = 0.0
    for asset, amount in reagents:
        stated = read_amount(amount)
        total += volume_of(asset, stated) * stated.portions
    return total


def vessel_for(volume: float, among: Sequence[str] = FLASKS, fill: float = FILL) -> str:
    """Return the smallest vessel that a volume in mL fills no further than it may.

    Raises:
        RefusalError: there is none.
    """
    catalog = Catalog.load()
    for name in among:
        limit = capacity(catalog.get(name))
        if limit is not None and volume <= fill * limit:
            return name
    raise RefusalError("infeasible", f"a batch of {volume / 1000:.3g} L is too large for every vessel of the inventory")


def bath_for(temperature: float | None) -> tuple[str, ...]:
    """Return the devices that bring a stirred vessel to a temperature in degrees Celsius, the stirrer included.

    Raises:
        RefusalError: nothing reaches it.
    """
    if temperature is None or ROOM[0] <= temperature <= ROOM[1]:
        return ("MagneticStirrer",)
    for limit, devices in (
        (-78.5, None),
        (-40.0, ("CoolingBathDewar", "MagneticStirrer")),
        (-15.0, ("LowTemperatureBath",)),
        (ROOM[0], ("IceBath", "MagneticStirrer")),
        (170.0, ("OilBath", "MagneticHotplateStirrer")),
        (290.0, ("SandBath", "OverheadStirrer")),
    ):
        if temperature < limit or (limit > ROOM[1] and temperature <= limit):
            if devices is None:
                break
            return devices
    raise RefusalError("infeasible", f"{temperature:g} C is out of reach: baths go from -78 C to 290 C")
