"""Plausible specifications: what a device of its kind, size and mass can be.

Each rule yields the specification at fault and what is wrong with it; `labgym.assets.checks` runs them all.
"""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.model import Asset, HeatClass

Fault = tuple[str, str]

LITRES = {"capacity_mL": 1e-3, "pack_mL": 1e-3, "chamber_L": 1.0, "storage_L": 1.0}
"""What is inside an asset, and litres to each unit."""
LEAST_SHARE = 0.01
"""Glassware holds at least this share of its bounding box; less is a slip of units."""
HOTTEST: dict[HeatClass, float] = {"bath": 300.0, "hot_surface": 800.0, "oven": 1800.0, "instrument": 600.0}
"""What a heat source without a flame can reach, degrees Celsius: oil burns, mantles and guns glow, furnaces go on."""
WARE = {"glassware": (70.0, 600.0), "plasticware": (50.0, 300.0), "ceramic": (70.0, 1800.0)}
"""Limits that ware is used at, degrees Celsius; borosilicate glass 3.3 is annealed at 560 (ISO 3585)."""
GLASS_BAR = 20.0
"""No glass vessel is built for more above the air's pressure."""
SOCKET = 3700.0
"""What a socket gives, 16 A at 230 V, in watts."""
STIRRED, CENTRIFUGED = 4000.0, 100_000.0
"""Fastest stirrer or shaker, and rotor of a centrifuge, turns a minute."""
RCF = 1.118e-5
"""Relative centrifugal force is this times the radius in centimetres times the square of the turns a minute."""
ROTOR = 3.0
"""Least radius of a rotor, centimetres."""
FACE = (0.3, 0.8)
"""Air into a fume hood, m/s: slower does not hold vapours back, faster is turbulent (as tested by EN 14175-3 and
ASHRAE 110; 0.4 to 0.6 is usual)."""
FLUSH = {"eyewash": 1.5, "shower": 75.7}
"""Least water of emergency equipment, L/min (ANSI/ISEA Z358.1)."""
KEPT = {"refrigerator": (0.0, 10.0), "freezer": (-200.0, -10.0)}
"""Where the temperatures of cold storage lie, degrees Celsius."""
DIVISIONS = (100.0, 1e8)
"""Least and most divisions of a balance's range."""


def faults(asset: Asset) -> Iterator[Fault]:
    """Yield every implausible specification of an asset."""
    for rule in RULES:
        yield from rule(asset)


def inside_fits(asset: Asset) -> Iterator[Fault]:
    """Check that an interior fits its box or hollow, and that glassware is mostly interior."""
    size, hollow = asset.size, asset.cavity
    box = 1000.0 * size.width * size.depth * size.height
    if hollow is not None:
        box = 1000.0 * hollow.width * hollow.depth * (hollow.z1 - hollow.z0)
    for name, litres in LITRES.items():
        value = getattr(asset.specs, name)
        if value is None:
            continue
        volume = value * litres
        if volume > box:
            yield name, f"{volume:.3g} L do not fit into its {'hollow' if hollow else 'box'} of {box:.3g} L"
        elif asset.category in WARE and volume < LEAST_SHARE * box and asset.subtype != "reactor":
            yield name, f"{volume:.3g} L are less than a hundredth of its box of {box:.3g} L; check the unit"


def loads_are_carried(asset: Asset) -> Iterator[Fault]:
    """Check that the contents of an asset weigh less than the whole."""
    specs, chemistry = asset.specs, asset.chemistry
    density = chemistry.density if chemistry is not None and chemistry.density else 0.0
    held = {
        "charge_kg": specs.charge_kg or 0.0,
        "pack_g": (specs.pack_g or 0.0) / 1000.0,
        "pack_mL": (specs.pack_mL or 0.0) * density / 1000.0,
    }
    for name, mass in held.items():
        if mass >= asset.mass:
            yield name, f"weighs {mass:.3g} kg, the whole only {asset.mass:g} kg"


def heat_is_specified(asset: Asset) -> Iterator[Fault]:
    """A heat source says how hot it gets, one with a plug how much power it takes, and nothing else heats."""
    specs, heat = asset.specs, asset.heat_class
    if heat is None:
        for name in ("heating_C", "flame_C"):
            if getattr(specs, name) is not None:
                yield name, "is given, but the asset is no heat source"
        return
    wanted = "flame_C" if heat == "flame" else "heating_C"
    if getattr(specs, wanted) is None:
        yield wanted, f"is missing; say how hot this heat source ({heat.replace('_', ' ')}) gets"
    if heat in HOTTEST and specs.heating_C is not None and specs.heating_C[1] > HOTTEST[heat]:
        yield "heating_C", f"{specs.heating_C[1]:g} C is beyond {HOTTEST[heat]:g} C, the most of its class, {heat}"
    if "electrical" in specs.features and specs.power_W is None:
        yield "power_W", "is missing; an electrical heat source takes power"


def power_has_a_plug(asset: Asset) -> Iterator[Fault]:
    """Check that powered devices are electrical, and that bench devices need no more power than a socket supplies."""
    power = asset.specs.power_W
    if power is None:
        return
    if "electrical" not in asset.specs.features:
        yield "power_W", f"{power:g} W, but 'electrical' is not among its features"
    if asset.placing == "desktop" and power > SOCKET:
        yield "power_W", f"{power:g} W are more than a socket gives ({SOCKET:g} W)"


def ware_withstands(asset: Asset) -> Iterator[Fault]:
    """Glass, plastics and ceramics are used below where they soften; glass holds no high pressure."""
    specs, bounds = asset.specs, WARE.get(asset.category)
    limit = specs.withstands_C
    if bounds is not None and limit is not None and not bounds[0] <= limit <= bounds[1]:
        yield "withstands_C", f"{limit:g} C is not within {bounds[0]:g} to {bounds[1]:g} C for {asset.category}"
    if asset.category == "glassware" and (specs.withstands_bar or 0.0) > GLASS_BAR:
        yield "withstands_bar", f"{specs.withstands_bar:g} bar is more than glass is built for ({GLASS_BAR:g} bar)"


def rotors_turn(asset: Asset) -> Iterator[Fault]:
    """Stirrers and rotors turn at speeds that there are, and a centrifuge's force is that of a rotor in its box."""
    specs = asset.specs
    speeds, centrifuge = specs.rotation_rpm, asset.subtype == "centrifuge"
    if speeds is not None and speeds[1] > (CENTRIFUGED if centrifuge else STIRRED):
        yield "rotation_rpm", f"{speeds[1]:g} rpm is more than a {asset.subtype} turns"
    if specs.centrifuge_xg is None:
        return
    if speeds is None:
        yield "rotation_rpm", "is missing; the force of a centrifuge is of a speed"
        return
    radius, room = specs.centrifuge_xg / (RCF * speeds[1] ** 2), 50.0 * asset.size.short
    if not ROTOR <= radius <= room:
        message = f"{specs.centrifuge_xg:g} x g at {speeds[1]:g} rpm is a radius of {radius:.3g} cm"
        yield "centrifuge_xg", f"{message}, not within {ROTOR:g} to {room:.3g} cm"


def hoods_draw(asset: Asset) -> Iterator[Fault]:
    """A fume hood, and nothing else, has a face velocity that holds vapours back, and a sash within its opening."""
    velocity, sash, hollow = asset.specs.face_velocity_m_s, asset.specs.sash_open_m, asset.cavity
    if not asset.fume_hood:
        if velocity is not None:
            yield "face_velocity_m_s", "is given, but the asset is no fume hood"
        return
    if velocity is None:
        yield "face_velocity_m_s", "is missing; a fume hood draws air"
    elif not FACE[0] <= velocity <= FACE[1]:
        yield "face_velocity_m_s", f"{velocity:g} m/s is not within {FACE[0]:g} to {FACE[1]:g} m/s"
    if sash is not None and hollow is not None and sash > hollow.z1 - hollow.z0:
        yield "sash_open_m", f"{sash:g} m is more than the inside is high"


def devices_do_their_work(asset: Asset) -> Iterator[Fault]:
    """Emergency water, cold storage, pumps and balances are specified as what they are."""
    specs = asset.specs
    least = FLUSH.get(asset.subtype)
    if least is not None and (specs.water_L_min or 0.0) < least:
        yield "water_L_min", f"{specs.water_L_min or 0.0:g} L/min is less than {least:g} L/min"
    kept = KEPT.get(asset.subtype) if asset.category == "cold_storage" else None
    cold = specs.cooling_C
    if kept is not None and (cold is None or not kept[0] <= cold[0] < cold[1] <= kept[1]):
        yield "cooling_C", f"a {asset.subtype} keeps a range within {kept[0]:g} to {kept[1]:g} C"
    if asset.category == "vacuum" and asset.subtype == "pump" and specs.ultimate_mbar is None:
        yield "ultimate_mbar", "is missing; say what pressure the pump reaches"
    if asset.subtype == "balance":
        most, division = specs.capacity_g, specs.resolution_g
        if most is None or division is None or not DIVISIONS[0] <= most / division <= DIVISIONS[1]:
            yield "resolution_g", f"with capacity_g a balance has {DIVISIONS[0]:g} to {DIVISIONS[1]:g} divisions"


RULES = (
    inside_fits,
    loads_are_carried,
    heat_is_specified,
    power_has_a_plug,
    ware_withstands,
    rotors_turn,
    hoods_draw,
    devices_do_their_work,
)
