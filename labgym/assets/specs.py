"""Specifications of an asset: what equipment reaches, withstands and holds, and what a reagent comes in.

Each field ends in its unit: `_C` degrees Celsius, `_bar` above the air's pressure, `_mbar` absolute, `_m_s` metres a
second. `quantity` splits a name into what and unit. A pair is a range from the least to the most.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from labgym.documents import Record

ROOM = 20.0
"""Where a heating or cooling range begins that starts at the room's temperature, degrees Celsius."""


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if not pair[0] < pair[1]:
        raise ValueError(f"a range goes from the least to the most, not from {pair[0]:g} to {pair[1]:g}")
    return pair


def _given(meaning: str) -> Any:
    return Field(default=None, description=meaning)


Celsius = Annotated[float, Field(ge=-273.15, le=3000.0)]
Bar = Annotated[float, Field(gt=0.0, le=2000.0)]
Millibar = Annotated[float, Field(gt=0.0, le=1013.0)]
Millilitres = Annotated[float, Field(gt=0.0, le=1e6)]
Litres = Annotated[float, Field(gt=0.0, le=1e4)]
Rpm = Annotated[float, Field(ge=0.0, le=150_000.0)]
Gravities = Annotated[float, Field(gt=0.0, le=1e6)]
Watts = Annotated[float, Field(gt=0.0, le=1e5)]
Grams = Annotated[float, Field(gt=0.0, le=1e6)]
Kilograms = Annotated[float, Field(gt=0.0, le=5000.0)]
Velocity = Annotated[float, Field(gt=0.0, le=5.0)]
Flow = Annotated[float, Field(gt=0.0, le=1e5)]
Length = Annotated[float, Field(gt=0.0, le=10.0)]
Millimetres = Annotated[float, Field(gt=0.0, le=5000.0)]
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
"""What an asset has or has not: mains power, an exhaust over a bench, a cabinet's own vent, and so on."""

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
    """What is specified of an asset; None or empty where it is not, or where it does not apply."""

    heating_C: Temperatures | None = _given("What a heat source heats to; from 20 where it begins at the room's.")
    cooling_C: Temperatures | None = _given("What a bath, chiller, refrigerator or freezer cools to and keeps.")
    flame_C: Celsius | None = _given("Temperature of a burner's flame.")
    working_C: Temperatures | None = _given("Temperatures of the contents that a reactor is built for.")
    measures_C: Temperatures | None = _given("What a thermometer reads.")
    withstands_C: Celsius | None = _given("Highest temperature that ware which does not heat is used at.")
    withstands_bar: Bar | None = _given("Highest pressure above the air's that a closed vessel is built for.")
    delivery_bar: Bar | None = _given("Highest pressure that a liquid pump delivers against.")
    filling_bar: Bar | None = _given("Pressure of a full gas cylinder at 15 C.")
    ultimate_mbar: Millibar | None = _given("Lowest pressure that a pump, or a device with one, reaches.")
    free_flow_m3_h: Flow | None = _given("Air that a vacuum pump moves with its inlet open.")

    capacity_mL: Millilitres | None = _given("What a vessel, bath or container holds; of a mantle, its flask.")
    working_mL: Annotated[tuple[Millilitres, Millilitres], Range] | None = _given(
        "Least and most that it works with, where that is not the usual share of its capacity."
    )
    stirring_mL: Millilitres | None = _given("Most that a stirrer stirs, as water.")
    chamber_L: Litres | None = _given("Room inside an oven, furnace, refrigerator or freezer.")
    storage_L: Litres | None = _given("Liquid in containers that a safety cabinet is approved for.")
    absorbs_L: Litres | None = _given("Liquid that a spill kit takes up.")

    rotation_rpm: Annotated[tuple[Rpm, Rpm], Range] | None = _given("Speeds of a stirrer, shaker or rotor.")
    centrifuge_xg: Gravities | None = _given("Greatest relative centrifugal force.")
    power_W: Watts | None = _given("Electrical power taken.")
    cooling_W: Watts | None = _given("Heat that a chiller carries off, at 20 C.")

    capacity_g: Grams | None = _given("Most that a balance weighs.")
    resolution_g: Grams | None = _given("Division of a balance.")
    measures_pH: Numbers | None = _given("What a pH meter or paper reads.")
    measures_nD: Numbers | None = _given("Refractive indices that a refractometer reads.")
    spectrum_nm: Numbers | None = _given("Wavelengths that a spectrometer covers.")
    lines_nm: Annotated[tuple[Number, ...], Field(max_length=16)] = Field(
        default=(), description="Wavelengths that a lamp gives or a polarimeter works at."
    )
    spectrum_cm1: Numbers | None = _given("Wavenumbers that an infrared spectrometer covers.")
    spectrum_mz: Numbers | None = _given("Masses over charge that a mass spectrometer covers.")
    proton_MHz: Number | None = _given("Frequency at which a nuclear magnetic resonance spectrometer sees protons.")
    five_gauss_m: Length | None = _given("How far a magnet's field stays above 0.5 mT.")
    ultrasound_kHz: Number | None = _given("Frequency of an ultrasonic bath.")
    magnification: Numbers | None = _given("How many times larger a microscope shows things.")

    flow_mL_min: Numbers | None = _given("Flow of a liquid that a pump delivers.")
    water_L_min: Flow | None = _given("Water of an eyewash, a shower or a purifier.")
    ice_kg_day: Flow | None = _given("Ice that a machine makes.")
    exhaust_m3_h: Flow | None = _given("Air that an exhaust arm draws off.")
    face_velocity_m_s: Velocity | None = _given("Mean speed of the air into a fume hood at its working opening.")
    sash_open_m: Length | None = _given("Height of a fume hood's working opening.")
    oxygen_ppm: Number | None = _given("Oxygen that a glove box keeps below.")
    moisture_ppm: Number | None = _given("Water vapour that a glove box keeps below.")

    load_kg: Kilograms | None = _given("Load of a bench's top, evenly spread.")
    shelf_load_kg: Kilograms | None = _given("Load of each shelf, evenly spread.")
    fire_rating_min: Count | None = _given("How long a cabinet keeps a fire from its contents.")
    agent: Literal["ABC", "CO2", "class_D"] | None = _given(
        "Agent of an extinguisher: powder, carbon dioxide, for metals."
    )
    charge_kg: Kilograms | None = _given("Agent that an extinguisher holds.")
    blanket_m: tuple[Length, Length] | None = _given("Sides of a fire blanket.")

    working_height_m: Heights | None = _given("Heights of a seat, a jack's plate, an eyewash's nozzles, a shower head.")
    edge_height_m: Length | None = _given("Height above the floor of a window's sill or a basin's rim.")
    lip_mm: Millimetres | None = _given("Raised edge that keeps bottles or a spill in.")
    diameter_mm: Millimetres | None = _given("Nominal diameter; of a column its inside.")
    jacket_mm: Millimetres | None = _given("Length of a condenser's jacket.")
    joint: Annotated[str, Field(pattern=r"^\d{1,2}/\d{1,2}$")] | None = _given("Ground joint, diameter/length in mm.")
    bowl_m: tuple[Length, Length, Length] | None = _given("Width, depth and height of a sink's bowl.")
    reach_m: Length | None = _given("Reach of an arm.")
    clear_width_m: Length | None = _given("Width of a door's opening.")
    clear_radius_m: Length | None = _given("Free space around an emergency shower's axis.")
    collision_radius_m: Length | None = _given("Circle that a robot keeps to on the floor.")
    screen_in: Number | None = _given("Diagonal of a screen.")
    places: Count | None = _given("Tubes of a rack, pegs, hooks, sockets, or taps of a manifold.")
    pieces: Count | None = _given("Gloves or towels of a full dispenser.")

    pack_mL: Millilitres | None = _given("Volume that a reagent comes in.")
    pack_g: Grams | None = _given("Mass that a reagent comes in.")
    container: Annotated[str, Field(max_length=80)] | None = _given("What a reagent comes in.")
    nfpa_special: Literal["W", "OX", "SA"] | None = _given("NFPA 704 sign: reacts with water, oxidiser, asphyxiates.")

    features: tuple[Feature, ...] = Field(default=(), description="What it has, such as mains power or a vent.")
    notes: Annotated[str, Field(max_length=300)] = Field(default="", description="Where a value is from, or doubtful.")

    @property
    def volume_mL(self) -> float | None:
        """Millilitres that it holds or, of a reagent, comes in."""
        return self.capacity_mL if self.capacity_mL is not None else self.pack_mL

    @model_validator(mode="before")
    @classmethod
    def _known(cls, data: Any) -> Any:
        """Name what would have been right where a specification is unknown."""
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
            raise ValueError("features: each once")
        return self

    @model_serializer(mode="wrap")
    def _brief(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what is not specified."""
        return {name: value for name, value in dump(self).items() if value not in (None, (), [], "")}

    def given(self) -> Iterator[tuple[str, Any]]:
        """Yield name and value of what is specified, in the order of the fields."""
        yield from ((name, value) for name, value in self if value not in (None, (), ""))


def quantity(name: str) -> tuple[str, str]:
    """Return what a field tells in words and its unit: "face_velocity_m_s" is ("face velocity", "m/s").

    The unit is empty for counts and words.
    """
    for unit in sorted(_UNITS, key=len, reverse=True):
        if name.endswith(f"_{unit}"):
            return name.removesuffix(f"_{unit}").replace("_", " "), _UNITS[unit]
    return name.replace("_", " "), ""


def _nearest(name: str) -> list[str]:
    """Return the fields that a wrong name may mean: of its unit, else of the nearest spelling, else all."""
    fields, unit = list(Specifications.model_fields), quantity(name)[1]
    alike = difflib.get_close_matches(name, fields, 3, 0.7)
    same = [field for field in fields if unit and quantity(field)[1] == unit]
    return alike or same or difflib.get_close_matches(name, fields, 3, 0.4) or fields


def spoken(name: str, value: Any) -> str:
    """Return a specification's value with its unit: "50 to 1500 rpm"."""
    unit = quantity(name)[1]
    if isinstance(value, tuple):
        numeric = [_figure(item) if isinstance(item, int | float) else item.replace("_", " ") for item in value]
        joined = {"bowl_m": " x ", "blanket_m": " x ", "lines_nm": " and ", "features": ", "}.get(name, " to ")
        text = joined.join(numeric)
    else:
        text = _figure(value) if isinstance(value, int | float) else str(value)
    return f"{text} {unit}".rstrip()


def _figure(value: float) -> str:
    """Write a number without an exponent, to six significant figures."""
    text = f"{value:.6g}"
    return f"{value:.10f}".rstrip("0").rstrip(".") if "e" in text else text
