"""Specifications of an asset: limits, capacities and fittings of equipment, and the pack of a reagent.

Each field name ends in its unit: `_C` degrees Celsius, `_bar` above ambient pressure, `_mbar` absolute, `_m_s` meters
per second. `quantity` splits a name into quantity and unit. A pair is a range from the least to the greatest value.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from labgym.documents import Record


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if not pair[0] < pair[1]:
        raise ValueError(f"a range must ascend, got {pair[0]:g} to {pair[1]:g}")
    return pair


def _optional(meaning: str) -> Any:
    return Field(default=None, description=meaning)


Celsius = Annotated[float, Field(ge=-273.15, le=3000.0)]
Bar = Annotated[float, Field(gt=0.0, le=2000.0)]
Millibar = Annotated[float, Field(gt=0.0, le=1013.0)]
Milliliters = Annotated[float, Field(gt=0.0, le=1e6)]
Liters = Annotated[float, Field(gt=0.0, le=1e4)]
Rpm = Annotated[float, Field(ge=0.0, le=150_000.0)]
Gravities = Annotated[float, Field(gt=0.0, le=1e6)]
Watts = Annotated[float, Field(gt=0.0, le=1e5)]
Grams = Annotated[float, Field(gt=0.0, le=1e6)]
Kilograms = Annotated[float, Field(gt=0.0, le=5000.0)]
Velocity = Annotated[float, Field(gt=0.0, le=5.0)]
Flow = Annotated[float, Field(gt=0.0, le=1e5)]
Length = Annotated[float, Field(gt=0.0, le=10.0)]
Millimeters = Annotated[float, Field(gt=0.0, le=5000.0)]
Count = Annotated[int, Field(gt=0, le=10_000)]
Number = Annotated[float, Field(ge=0.0, le=1e6)]
Range = AfterValidator(_ordered)
Temperatures = Annotated[tuple[Celsius, Celsius], Range]
Numbers = Annotated[tuple[Number, Number], Range]
Heights = Annotated[tuple[Length, Length], Range]

Feature = Literal[
    "electrical",
    "local_exhaust",
    "ventilated",
    "double_sided",
    "casters",
    "under_bench",
    "self_closing",
    "lockable",
    "trays",
    "secondary_containment",
    "non_combustible_shelves",
    "dry",
]
"""Fittings of an asset: mains power, an exhaust over a bench, a cabinet's own vent, and so on."""

_UNITS = {
    "m3_h": "m3/h",
    "mL_min": "mL/min",
    "L_min": "L/min",
    "kg_day": "kg/day",
    "m_s": "m/s",
    "cm1": "1/cm",
    "xg": "x g",
    **{
        unit: unit
        for unit in ("C", "bar", "mbar", "mL", "L", "rpm", "W", "g", "kg", "m", "mm", "nm", "kHz", "MHz", "ppm", "min")
    },
    "mz": "m/z",
    "in": "inches",
    "pH": "pH",
    "nD": "nD",
}


class Specifications(Record):
    """Specifications of an asset; None or empty if not specified or not applicable."""

    heating_C: Temperatures | None = _optional(
        "Temperatures that a heat source reaches; from 20 if it starts at room temperature."
    )
    cooling_C: Temperatures | None = _optional("Temperatures that a bath, chiller, refrigerator or freezer keeps.")
    flame_C: Celsius | None = _optional("Temperature of a burner's flame.")
    working_C: Temperatures | None = _optional("Temperatures of the contents that a reactor is rated for.")
    measures_C: Temperatures | None = _optional("Temperatures that a thermometer reads.")
    withstands_C: Celsius | None = _optional("Highest temperature at which ware without a heater is used.")
    withstands_bar: Bar | None = _optional("Highest pressure above ambient that a closed vessel is rated for.")
    delivery_bar: Bar | None = _optional("Highest pressure that a liquid pump delivers against.")
    filling_bar: Bar | None = _optional("Pressure of a full gas cylinder at 15 C.")
    ultimate_mbar: Millibar | None = _optional("Lowest pressure that a pump, or a device with a pump, reaches.")
    free_flow_m3_h: Flow | None = _optional("Air flow of a vacuum pump with an open inlet.")

    capacity_mL: Milliliters | None = _optional("Capacity of a vessel, bath or container; of a mantle, of its flask.")
    working_mL: Annotated[tuple[Milliliters, Milliliters], Range] | None = _optional(
        "Least and greatest working volume, if not the usual share of the capacity."
    )
    stirring_mL: Milliliters | None = _optional("Greatest volume of water that a stirrer stirs.")
    chamber_L: Liters | None = _optional("Internal volume of an oven, furnace, refrigerator or freezer.")
    storage_L: Liters | None = _optional("Liquid in containers that a safety cabinet is approved for.")
    absorbs_L: Liters | None = _optional("Liquid that a spill kit takes up.")

    rotation_rpm: Annotated[tuple[Rpm, Rpm], Range] | None = _optional("Speeds of a stirrer, shaker or rotor.")
    centrifuge_xg: Gravities | None = _optional("Greatest relative centrifugal force.")
    power_W: Watts | None = _optional("Electrical power taken.")
    cooling_W: Watts | None = _optional("Cooling power of a chiller at 20 C.")

    capacity_g: Grams | None = _optional("Capacity of a balance.")
    resolution_g: Grams | None = _optional("Readability of a balance.")
    measures_pH: Numbers | None = _optional("pH range of a meter or paper.")
    measures_nD: Numbers | None = _optional("Range of refractive indices of a refractometer.")
    spectrum_nm: Numbers | None = _optional("Wavelengths that a spectrometer covers.")
    lines_nm: Annotated[tuple[Number, ...], Field(max_length=16)] = Field(
        default=(), description="Wavelengths of a lamp or a polarimeter."
    )
    spectrum_cm1: Numbers | None = _optional("Wavenumbers that an infrared spectrometer covers.")
    spectrum_mz: Numbers | None = _optional("Masses over charge that a mass spectrometer covers.")
    proton_MHz: Number | None = _optional("Proton frequency of a nuclear magnetic resonance spectrometer.")
    five_gauss_m: Length | None = _optional("Distance up to which a magnet's field exceeds 0.5 mT.")
    ultrasound_kHz: Number | None = _optional("Frequency of an ultrasonic bath.")
    magnification: Numbers | None = _optional("Magnification of a microscope.")

    flow_mL_min: Numbers | None = _optional("Liquid flow of a pump.")
    water_L_min: Flow | None = _optional("Water flow of an eyewash, a shower or a purifier.")
    ice_kg_day: Flow | None = _optional("Output of an ice machine.")
    exhaust_m3_h: Flow | None = _optional("Air flow of an exhaust arm.")
    face_velocity_m_s: Velocity | None = _optional("Mean air speed into a fume hood at its working opening.")
    sash_open_m: Length | None = _optional("Height of a fume hood's working opening.")
    oxygen_ppm: Number | None = _optional("Oxygen limit of a glove box.")
    moisture_ppm: Number | None = _optional("Water vapor limit of a glove box.")

    load_kg: Kilograms | None = _optional("Evenly distributed load of a bench top.")
    shelf_load_kg: Kilograms | None = _optional("Evenly distributed load of each shelf.")
    fire_rating_min: Count | None = _optional("Fire rating of a cabinet.")
    agent: Literal["ABC", "CO2", "class_D"] | None = _optional(
        "Agent of an extinguisher: powder, carbon dioxide, for metals."
    )
    charge_kg: Kilograms | None = _optional("Mass of an extinguisher's agent.")
    blanket_m: tuple[Length, Length] | None = _optional("Sides of a fire blanket.")

    working_height_m: Heights | None = _optional(
        "Heights of a seat, a jack's plate, an eyewash's nozzles, a shower head."
    )
    edge_height_m: Length | None = _optional("Height above the floor of a window's sill or a basin's rim.")
    lip_mm: Millimeters | None = _optional("Height of the raised edge that retains bottles or a spill.")
    diameter_mm: Millimeters | None = _optional("Nominal diameter; of a column its inside.")
    jacket_mm: Millimeters | None = _optional("Length of a condenser's jacket.")
    joint: Annotated[str, Field(pattern=r"^\d{1,2}/\d{1,2}$")] | None = _optional(
        "Ground joint, diameter/length in mm."
    )
    bowl_m: tuple[Length, Length, Length] | None = _optional("Width, depth and height of a sink's bowl.")
    reach_m: Length | None = _optional("Reach of an arm.")
    clear_width_m: Length | None = _optional("Width of a door's opening.")
    clear_radius_m: Length | None = _optional("Radius of the clear space around an emergency shower's axis.")
    collision_radius_m: Length | None = _optional("Radius of a robot's footprint.")
    screen_in: Number | None = _optional("Diagonal of a screen.")
    places: Count | None = _optional("Tubes of a rack, pegs, hooks, sockets, or taps of a manifold.")
    pieces: Count | None = _optional("Gloves or towels of a full dispenser.")

    pack_mL: Milliliters | None = _optional("Volume of a reagent's pack.")
    pack_g: Grams | None = _optional("Mass of a reagent's pack.")
    container: Annotated[str, Field(max_length=80)] | None = _optional("Container of a reagent.")
    nfpa_special: Literal["W", "OX", "SA"] | None = _optional(
        "NFPA 704 sign: reacts with water (W), oxidizer (OX), simple asphyxiant (SA)."
    )

    features: tuple[Feature, ...] = Field(default=(), description="Fittings, such as mains power or a vent.")
    notes: Annotated[str, Field(max_length=300)] = Field(default="", description="Source of a value, or a doubt.")

    @property
    def volume_mL(self) -> float | None:
        """Capacity or, for a reagent, pack size, mL."""
        return self.capacity_mL if self.capacity_mL is not None else self.pack_mL

    @model_validator(mode="before")
    @classmethod
    def _has_known_names(cls, data: Any) -> Any:
        """Refuse unknown specifications with the nearest names."""
        for name in data if isinstance(data, dict) else ():
            if name not in cls.model_fields:
                raise ValueError(f"no specification {str(name)[:80]!r}; nearest: {', '.join(_nearest(str(name)[:80]))}")
        return data

    @model_validator(mode="after")
    def _agree(self) -> Self:
        if self.capacity_g is not None and self.resolution_g is not None and self.resolution_g >= self.capacity_g:
            raise ValueError(f"resolution_g {self.resolution_g:g} must be less than capacity_g {self.capacity_g:g}")
        if self.capacity_mL is not None and self.working_mL is not None and self.working_mL[1] > self.capacity_mL:
            raise ValueError(f"working_mL ends at {self.working_mL[1]:g}, above capacity_mL {self.capacity_mL:g}")
        if len(set(self.features)) != len(self.features):
            raise ValueError("features: each may occur only once")
        return self

    @model_serializer(mode="wrap")
    def _brief(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Omit unspecified fields."""
        return {name: value for name, value in dump(self).items() if value not in (None, (), [], "")}

    def items(self) -> Iterator[tuple[str, Any]]:
        """Yield the name and value of each specification, in the order of the fields."""
        yield from ((name, value) for name, value in self if value not in (None, (), ""))


def quantity(name: str) -> tuple[str, str]:
    """Return the quantity and the unit of a field: "face_velocity_m_s" gives ("face velocity", "m/s").

    Counts and words have an empty unit.
    """
    for unit in sorted(_UNITS, key=len, reverse=True):
        if name.endswith(f"_{unit}"):
            return name.removesuffix(f"_{unit}").replace("_", " "), _UNITS[unit]
    return name.replace("_", " "), ""


def _nearest(name: str) -> list[str]:
    """Return the fields that a wrong name may mean: the nearest by spelling, else those of its unit, else all."""
    fields, unit = list(Specifications.model_fields), quantity(name)[1]
    alike = difflib.get_close_matches(name, fields, 3, 0.7)
    same = [field for field in fields if unit and quantity(field)[1] == unit]
    return alike or same or difflib.get_close_matches(name, fields, 3, 0.4) or fields


def value_text(name: str, value: Any) -> str:
    """Return a specification's value with its unit: "50 to 1500 rpm"."""
    unit = quantity(name)[1]
    if isinstance(value, tuple):
        numeric = [_number_text(item) if isinstance(item, int | float) else item.replace("_", " ") for item in value]
        joined = {"bowl_m": " x ", "blanket_m": " x ", "lines_nm": " and ", "features": ", "}.get(name, " to ")
        text = joined.join(numeric)
    else:
        text = _number_text(value) if isinstance(value, int | float) else str(value)
    return f"{text} {unit}".rstrip()


def _number_text(value: float) -> str:
    """Write a number without an exponent, to six significant figures."""
    text = f"{value:.6g}"
    return f"{value:.10f}".rstrip("0").rstrip(".") if "e" in text else text
