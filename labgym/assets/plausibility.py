"""Plausible sizes of classes of assets, and specifications of a device of a given kind, size and mass.

Each rule yields the implausible specification and the problem; `labgym.assets.checks` runs all rules.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from labgym.assets.model import Asset, HeatClass, Kind, Placing


@dataclass(frozen=True)
class Bounds:
    """Least and greatest side of a bounding box, meters."""

    least: float
    greatest: float


GLASSWARE = Bounds(0.005, 0.90)
BENCH_TOP = Bounds(0.004, 1.60)
CONTAINER = Bounds(0.03, 0.50)
CYLINDER = Bounds(0.05, 1.80)
FLOOR_STANDING = Bounds(0.15, 3.50)
ON_WALL = Bounds(0.01, 3.50)
MAX_FLOOR_OBJECT_M = 5.0
"""Greatest side of an object on the floor whose size the layout states, meters: a row of units may be one object."""

GLASS_CATEGORIES = ("glassware", "ceramic")
_SLIPS = {
    1000.0: "meters divided by 1000",
    100.0: "meters divided by 100",
    10.0: "meters divided by 10",
    0.0254: "inches",
    0.01: "centimeters",
    0.001: "millimeters",
}
"""Factor that corrects the size, and the unit that was then used instead of meters."""


def bounds(asset: Asset) -> Bounds:
    """Return the permitted side lengths of an asset of this kind, category and placing."""
    return bounds_of(asset.kind, asset.category, asset.placing, asset.phase == "gas")


def bounds_of(kind: Kind, category: str, placing: Placing, gas: bool = False) -> Bounds:
    """Return the permitted side lengths of an asset; `gas` applies to reagents only."""
    if kind == "reagent":
        return CYLINDER if gas else CONTAINER
    if placing == "floor":
        return FLOOR_STANDING
    if placing == "wall":
        return ON_WALL
    return GLASSWARE if category in GLASS_CATEGORIES else BENCH_TOP


def size_problem(asset: Asset, on_floor: bool = False) -> str | None:
    """Return why an asset's size is implausible, with the likely unit; None if it is plausible.

    Args:
        on_floor: whether it is the size of an object that a layout places on the floor.
    """
    allowed = bounds(asset)
    if on_floor:
        allowed = Bounds(allowed.least, MAX_FLOOR_OBJECT_M)
    sides = (asset.size.width, asset.size.depth, asset.size.height)
    if all(allowed.least <= side <= allowed.greatest for side in sides):
        return None
    measured = " x ".join(f"{side:g}" for side in sides)
    what = f"{asset.placing} {asset.kind} of category {asset.category!r}"
    slips = _likely_slips(sides, allowed)
    remedy = f"likely given in {' or '.join(slips)}" if slips else "give width, depth and height in meters"
    expected = f"outside {allowed.least:g} to {allowed.greatest:g} m for a {what}"
    return f"size {measured} m of {asset.name!r} is {expected}; {remedy}"


def _likely_slips(sides: tuple[float, ...], allowed: Bounds) -> list[str]:
    """Return the unit errors whose correction brings every side into bounds."""
    return [
        name
        for factor, name in _SLIPS.items()
        if all(allowed.least <= side * factor <= allowed.greatest for side in sides)
    ]


Fault = tuple[str, str]

LITERS_PER_UNIT = {"capacity_mL": 1e-3, "pack_mL": 1e-3, "chamber_L": 1.0, "storage_L": 1.0}
"""Specifications of contents, and liters per unit."""
MIN_FILL_SHARE = 0.01
"""Least volume of glassware as a share of its bounding box; less is a wrong unit."""
MAX_HEATING_C: dict[HeatClass, float] = {"bath": 300.0, "hot_surface": 800.0, "oven": 1800.0, "instrument": 600.0}
"""Highest temperature of a heat source without a flame, by class, degrees Celsius."""
WARE_LIMITS_C = {"glassware": (70.0, 600.0), "plasticware": (50.0, 300.0), "ceramic": (70.0, 1800.0)}
"""Least and greatest temperature limit of ware, degrees Celsius; borosilicate glass anneals at 560 (ISO 3585)."""
MAX_GLASS_BAR = 20.0
"""Highest pressure above ambient of a glass vessel, bar."""
SOCKET_W = 3700.0
"""Power of a mains socket, 16 A at 230 V, watts."""
MAX_STIRRER_RPM, MAX_CENTRIFUGE_RPM = 4000.0, 100_000.0
"""Highest speed of a stirrer or shaker, and of a centrifuge rotor, rpm."""
RCF_PER_CM_RPM2 = 1.118e-5
"""Relative centrifugal force over the product of radius (cm) and squared speed (rpm)."""
MIN_ROTOR_CM = 3.0
"""Least radius of a rotor, centimeters."""
FACE_VELOCITY_M_S = (0.3, 0.8)
"""Face velocity of a fume hood, m/s: below it does not contain vapors, above it is turbulent (tests: EN 14175-3 and
ASHRAE 110; 0.4 to 0.6 is usual)."""
MIN_FLUSH_L_MIN = {"eyewash": 1.5, "shower": 75.7}
"""Least water flow of emergency equipment, L/min (ANSI/ISEA Z358.1)."""
COLD_STORAGE_C = {"refrigerator": (0.0, 10.0), "freezer": (-200.0, -10.0)}
"""Temperature range of cold storage, degrees Celsius."""
BALANCE_DIVISIONS = (100.0, 1e8)
"""Least and greatest ratio of capacity to readability of a balance."""


def faults(asset: Asset) -> Iterator[Fault]:
    """Yield every implausible specification of an asset."""
    for rule in RULES:
        yield from rule(asset)


def contents_fit(asset: Asset) -> Iterator[Fault]:
    """Yield capacities that exceed the bounding box or cavity, or are a small fraction of glassware."""
    size, hollow = asset.size, asset.cavity
    box = 1000.0 * size.width * size.depth * size.height
    if hollow is not None:
        box = 1000.0 * hollow.width * hollow.depth * (hollow.z1 - hollow.z0)
    for name, liters in LITERS_PER_UNIT.items():
        value = getattr(asset.specs, name)
        if value is None:
            continue
        volume = value * liters
        if volume > box:
            yield name, f"{volume:.3g} L does not fit into its {'hollow' if hollow else 'box'} of {box:.3g} L"
        elif asset.category in WARE_LIMITS_C and volume < MIN_FILL_SHARE * box and asset.subtype != "reactor":
            yield name, f"{volume:.3g} L is less than 1 % of its bounding box of {box:.3g} L: check the unit"


def contents_weigh_less(asset: Asset) -> Iterator[Fault]:
    """Yield contents that weigh as much as the whole asset."""
    specs, chemistry = asset.specs, asset.chemistry
    density = chemistry.density if chemistry is not None and chemistry.density else 0.0
    contents = {
        "charge_kg": specs.charge_kg or 0.0,
        "pack_g": (specs.pack_g or 0.0) / 1000.0,
        "pack_mL": (specs.pack_mL or 0.0) * density / 1000.0,
    }
    for name, mass in contents.items():
        if mass >= asset.mass:
            yield name, f"weighs {mass:.3g} kg, but the whole asset weighs {asset.mass:g} kg"


def heat_is_specified(asset: Asset) -> Iterator[Fault]:
    """Yield heat sources without temperature or electrical power, and temperatures of other assets."""
    specs, heat = asset.specs, asset.heat_class
    if heat is None:
        for name in ("heating_C", "flame_C"):
            if getattr(specs, name) is not None:
                yield name, "must be absent: the asset is not a heat source"
        return
    required = "flame_C" if heat == "flame" else "heating_C"
    if getattr(specs, required) is None:
        yield required, f"is missing: required for a heat source of class {heat}"
    if heat in MAX_HEATING_C and specs.heating_C is not None and specs.heating_C[1] > MAX_HEATING_C[heat]:
        yield "heating_C", f"{specs.heating_C[1]:g} C exceeds {MAX_HEATING_C[heat]:g} C, the limit of class {heat}"
    if "electrical" in specs.features and specs.power_W is None:
        yield "power_W", "is missing: required for an electrical heat source"


def power_has_a_plug(asset: Asset) -> Iterator[Fault]:
    """Yield powers without the feature electrical, and bench devices that exceed a mains socket."""
    power = asset.specs.power_W
    if power is None:
        return
    if "electrical" not in asset.specs.features:
        yield "power_W", f"{power:g} W, but 'electrical' is not among its features"
    if asset.placing == "desktop" and power > SOCKET_W:
        yield "power_W", f"{power:g} W exceeds a mains socket ({SOCKET_W:g} W)"


def ware_withstands(asset: Asset) -> Iterator[Fault]:
    """Yield temperature limits beyond the material, and high pressures in glass."""
    specs, bounds = asset.specs, WARE_LIMITS_C.get(asset.category)
    limit = specs.withstands_C
    if bounds is not None and limit is not None and not bounds[0] <= limit <= bounds[1]:
        yield "withstands_C", f"{limit:g} C is not within {bounds[0]:g} to {bounds[1]:g} C for {asset.category}"
    if asset.category == "glassware" and (specs.withstands_bar or 0.0) > MAX_GLASS_BAR:
        yield "withstands_bar", f"{specs.withstands_bar:g} bar exceeds {MAX_GLASS_BAR:g} bar, the limit of glass"


def rotors_turn(asset: Asset) -> Iterator[Fault]:
    """Yield speeds beyond real devices, and centrifugal forces that need a rotor larger than the device."""
    specs = asset.specs
    speeds, centrifuge = specs.rotation_rpm, asset.subtype == "centrifuge"
    if speeds is not None and speeds[1] > (MAX_CENTRIFUGE_RPM if centrifuge else MAX_STIRRER_RPM):
        yield "rotation_rpm", f"{speeds[1]:g} rpm exceeds the speed of a {asset.subtype}"
    if specs.centrifuge_xg is None:
        return
    if speeds is None:
        yield "rotation_rpm", "is missing: required with centrifuge_xg"
        return
    radius, limit = specs.centrifuge_xg / (RCF_PER_CM_RPM2 * speeds[1] ** 2), 50.0 * asset.size.short
    if not MIN_ROTOR_CM <= radius <= limit:
        message = f"{specs.centrifuge_xg:g} x g at {speeds[1]:g} rpm requires a radius of {radius:.3g} cm"
        yield "centrifuge_xg", f"{message}, not within {MIN_ROTOR_CM:g} to {limit:.3g} cm"


def hoods_draw(asset: Asset) -> Iterator[Fault]:
    """Yield fume hoods with a wrong face velocity or a sash beyond the opening, and face velocities of other assets."""
    least, greatest = FACE_VELOCITY_M_S
    velocity, sash, hollow = asset.specs.face_velocity_m_s, asset.specs.sash_open_m, asset.cavity
    if not asset.fume_hood:
        if velocity is not None:
            yield "face_velocity_m_s", "must be absent: the asset is not a fume hood"
        return
    if velocity is None:
        yield "face_velocity_m_s", "is missing: required for a fume hood"
    elif not least <= velocity <= greatest:
        yield "face_velocity_m_s", f"{velocity:g} m/s is not within {least:g} to {greatest:g} m/s"
    if sash is not None and hollow is not None and sash > hollow.z1 - hollow.z0:
        yield "sash_open_m", f"{sash:g} m exceeds the height of the inside"


def devices_do_their_work(asset: Asset) -> Iterator[Fault]:
    """Yield emergency equipment, cold storage, pumps and balances outside their standards or usual ranges."""
    specs = asset.specs
    least = MIN_FLUSH_L_MIN.get(asset.subtype)
    if least is not None and (specs.water_L_min or 0.0) < least:
        yield "water_L_min", f"{specs.water_L_min or 0.0:g} L/min is less than {least:g} L/min"
    bounds = COLD_STORAGE_C.get(asset.subtype) if asset.category == "cold_storage" else None
    cold = specs.cooling_C
    if bounds is not None and (cold is None or not bounds[0] <= cold[0] < cold[1] <= bounds[1]):
        yield "cooling_C", f"expected a range within {bounds[0]:g} to {bounds[1]:g} C"
    if asset.category == "vacuum" and asset.subtype == "pump" and specs.ultimate_mbar is None:
        yield "ultimate_mbar", "is missing: required for a pump"
    if asset.subtype == "balance":
        most, division = specs.capacity_g, specs.resolution_g
        if most is None or division is None or not BALANCE_DIVISIONS[0] <= most / division <= BALANCE_DIVISIONS[1]:
            yield (
                "resolution_g",
                f"capacity_g over resolution_g must be {BALANCE_DIVISIONS[0]:g} to {BALANCE_DIVISIONS[1]:g}",
            )


RULES = (
    contents_fit,
    contents_weigh_less,
    heat_is_specified,
    power_has_a_plug,
    ware_withstands,
    rotors_turn,
    hoods_draw,
    devices_do_their_work,
)
