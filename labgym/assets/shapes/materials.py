"""Named materials: color and optical properties."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.errors import check_name

Rgba = tuple[float, float, float, float]


@dataclass(frozen=True)
class SurfaceMaterial:
    """How a surface looks.

    Attributes:
        rgba: color in sRGB as MuJoCo takes it, and opacity, each in [0, 1].
        specular: strength of highlights in [0, 1]. shininess: their sharpness in [0, 1].
        reflectance: share of light mirrored, in [0, 1]. emission: share of its color that it glows with.
    """

    rgba: Rgba
    specular: float = 0.2
    shininess: float = 0.3
    reflectance: float = 0.0
    emission: float = 0.0


def _matt(r: float, g: float, b: float) -> SurfaceMaterial:
    return SurfaceMaterial((r, g, b, 1.0), specular=0.1, shininess=0.1)


def _satin(r: float, g: float, b: float) -> SurfaceMaterial:
    return SurfaceMaterial((r, g, b, 1.0), specular=0.3, shininess=0.4)


def _gloss(r: float, g: float, b: float) -> SurfaceMaterial:
    return SurfaceMaterial((r, g, b, 1.0), specular=0.6, shininess=0.8)


def _glass(r: float, g: float, b: float, opacity: float) -> SurfaceMaterial:
    return SurfaceMaterial((r, g, b, opacity), specular=0.9, shininess=0.95)


def _glow(r: float, g: float, b: float) -> SurfaceMaterial:
    return SurfaceMaterial((r, g, b, 1.0), specular=0.2, shininess=0.6, emission=0.55)


MATERIALS: dict[str, SurfaceMaterial] = {
    # metals
    "stainless": SurfaceMaterial((0.73, 0.75, 0.77, 1.0), specular=0.7, shininess=0.6, reflectance=0.15),
    "chrome": SurfaceMaterial((0.82, 0.84, 0.87, 1.0), specular=1.0, shininess=0.9, reflectance=0.25),
    "aluminium": SurfaceMaterial((0.66, 0.68, 0.70, 1.0), specular=0.5, shininess=0.5),
    "cast_iron": _satin(0.24, 0.25, 0.27),
    "brass": SurfaceMaterial((0.80, 0.63, 0.27, 1.0), specular=0.7, shininess=0.7),
    "galvanised": _satin(0.58, 0.61, 0.63),
    # glass, liquids, ceramics
    "borosilicate": _glass(0.82, 0.92, 0.95, 0.34),
    "thick_glass": _glass(0.74, 0.89, 0.90, 0.50),
    "window_glass": _glass(0.72, 0.86, 0.92, 0.30),
    "sash_glass": _glass(0.80, 0.92, 0.94, 0.16),
    "daylight": SurfaceMaterial((0.86, 0.93, 1.0, 1.0), specular=0.2, shininess=0.8, emission=0.35),
    "amber_glass": _glass(0.46, 0.22, 0.06, 0.90),
    "blue_liquid": _glass(0.20, 0.48, 0.82, 0.72),
    "yellow_liquid": _glass(0.93, 0.78, 0.24, 0.72),
    "clear_liquid": _glass(0.72, 0.85, 0.92, 0.55),
    "oil": _glass(0.87, 0.70, 0.32, 0.80),
    "ice": SurfaceMaterial((0.88, 0.95, 1.0, 0.92), specular=0.6, shininess=0.7),
    "porcelain": _gloss(0.94, 0.93, 0.90),
    "silica": _matt(0.95, 0.94, 0.90),
    "sand": _matt(0.80, 0.70, 0.52),
    # worktops and carpentry
    "epoxy_white": _satin(0.90, 0.91, 0.90),
    "epoxy_black": _satin(0.15, 0.16, 0.18),
    "phenolic_black": _satin(0.12, 0.13, 0.14),
    "laminate_grey": _satin(0.80, 0.82, 0.83),
    "laminate_white": _satin(0.91, 0.91, 0.89),
    "oak": _satin(0.72, 0.53, 0.34),
    "edge_blue": _satin(0.20, 0.44, 0.66),
    "edge_teal": _satin(0.13, 0.52, 0.52),
    "hood_lining": _satin(0.52, 0.54, 0.56),
    "granite": _satin(0.46, 0.46, 0.48),
    # coated steel and plastics
    "powder_white": _satin(0.92, 0.93, 0.93),
    "powder_grey": _satin(0.62, 0.65, 0.68),
    "powder_dark": _satin(0.28, 0.31, 0.35),
    "safety_yellow": _satin(0.96, 0.76, 0.08),
    "safety_red": _satin(0.80, 0.13, 0.12),
    "safety_orange": _satin(0.93, 0.47, 0.10),
    "signal_green": _satin(0.06, 0.56, 0.31),
    "signal_blue": _satin(0.10, 0.34, 0.66),
    "cabinet_blue": _satin(0.16, 0.40, 0.70),
    "cabinet_white": _satin(0.93, 0.93, 0.91),
    "poison_purple": _satin(0.45, 0.27, 0.56),
    "gas_grey": _satin(0.48, 0.51, 0.54),
    "gas_black": _satin(0.16, 0.17, 0.18),
    "gas_dark_green": _satin(0.07, 0.36, 0.22),
    "gas_red": _satin(0.76, 0.12, 0.12),
    "plastic_white": _satin(0.93, 0.93, 0.92),
    "plastic_light": _satin(0.82, 0.84, 0.85),
    "plastic_grey": _satin(0.55, 0.58, 0.61),
    "plastic_dark": _satin(0.22, 0.24, 0.27),
    "plastic_black": _satin(0.10, 0.11, 0.12),
    "abs_blue": _satin(0.12, 0.36, 0.68),
    "abs_red": _satin(0.78, 0.17, 0.15),
    "abs_green": _satin(0.20, 0.56, 0.33),
    "polyethylene": SurfaceMaterial((0.93, 0.95, 0.95, 0.86), specular=0.2, shininess=0.3),
    "polypropylene": SurfaceMaterial((0.86, 0.90, 0.92, 0.70), specular=0.3, shininess=0.4),
    "ptfe": _matt(0.96, 0.96, 0.96),
    "rubber": _matt(0.13, 0.13, 0.14),
    "rubber_orange": _matt(0.74, 0.34, 0.17),
    "silicone_blue": _matt(0.20, 0.45, 0.75),
    "glove": _matt(0.17, 0.17, 0.19),
    "seat": _satin(0.15, 0.25, 0.40),
    "cork": _matt(0.70, 0.52, 0.34),
    "cardboard": _matt(0.74, 0.58, 0.40),
    "foam": _matt(0.93, 0.93, 0.95),
    # lights, screens, prints
    "screen": _glow(0.16, 0.42, 0.62),
    "screen_dark": _gloss(0.06, 0.08, 0.10),
    "screen_green": _glow(0.22, 0.62, 0.36),
    "display_lcd": SurfaceMaterial((0.66, 0.76, 0.62, 1.0), specular=0.2, shininess=0.6, emission=0.1),
    "lamp": SurfaceMaterial((1.0, 0.98, 0.92, 1.0), emission=0.9),
    "lamp_green": SurfaceMaterial((0.25, 0.90, 0.40, 1.0), emission=0.8),
    "lamp_uv": SurfaceMaterial((0.48, 0.30, 0.95, 1.0), emission=0.8),
    "flame_blue": SurfaceMaterial((0.30, 0.55, 1.0, 0.75), emission=0.9),
    "paper": _matt(0.96, 0.96, 0.95),
    "print_black": _matt(0.07, 0.07, 0.08),
    "print_red": _matt(0.85, 0.12, 0.12),
    # the building
    "wall_paint": _matt(0.88, 0.89, 0.88),
    "wall_accent": _matt(0.62, 0.75, 0.78),
    "wall_cap": _matt(0.60, 0.64, 0.67),
    "skirting": _matt(0.36, 0.40, 0.43),
    "floor_vinyl": SurfaceMaterial((0.74, 0.76, 0.77, 1.0), specular=0.2, shininess=0.4, reflectance=0.06),
    "ceiling": _matt(0.95, 0.95, 0.94),
    "door_leaf": _satin(0.69, 0.75, 0.78),
    "door_frame": _satin(0.33, 0.37, 0.41),
}
"""All materials by name."""

WALL_PAINTS = ("wall_paint", "wall_cream", "wall_gray", "wall_sage", "wall_sky")
ACCENT_PAINTS = ("wall_accent", "accent_navy", "accent_ochre", "accent_brick", "accent_graphite")

FINISHES: dict[str, SurfaceMaterial] = {
    "floor_epoxy": SurfaceMaterial((0.58, 0.63, 0.66, 1.0), specular=0.5, shininess=0.7),
    "floor_tile": SurfaceMaterial((0.78, 0.75, 0.70, 1.0), specular=0.3, shininess=0.5),
    "floor_terrazzo": SurfaceMaterial((0.70, 0.69, 0.66, 1.0), specular=0.4, shininess=0.6),
    "floor_concrete": _matt(0.60, 0.60, 0.59),
    "wall_cream": _matt(0.90, 0.87, 0.79),
    "wall_gray": _matt(0.76, 0.78, 0.79),
    "wall_sage": _matt(0.77, 0.82, 0.75),
    "wall_sky": _matt(0.78, 0.84, 0.89),
    "accent_navy": _matt(0.25, 0.33, 0.47),
    "accent_ochre": _matt(0.80, 0.63, 0.33),
    "accent_brick": _matt(0.66, 0.40, 0.33),
    "accent_graphite": _matt(0.34, 0.36, 0.39),
    "worktop_gray": _satin(0.62, 0.64, 0.65),
    "worktop_sand": _satin(0.79, 0.74, 0.64),
    "worktop_slate": _satin(0.30, 0.34, 0.38),
    "front_oak": _satin(0.76, 0.60, 0.42),
    "front_walnut": _satin(0.44, 0.31, 0.22),
    "front_blue": _satin(0.62, 0.73, 0.82),
    "front_gray": _satin(0.55, 0.58, 0.60),
    "front_mint": _satin(0.68, 0.80, 0.74),
    "edge_gray": _satin(0.36, 0.39, 0.42),
    "edge_brown": _satin(0.33, 0.24, 0.18),
    "edge_green": _satin(0.22, 0.46, 0.36),
    "door_white": _satin(0.90, 0.90, 0.88),
    "door_oak": _satin(0.73, 0.56, 0.37),
    "door_walnut": _satin(0.41, 0.28, 0.20),
    "door_green": _satin(0.40, 0.52, 0.46),
    "studio": _matt(0.68, 0.72, 0.76),
    "blind": _matt(0.88, 0.87, 0.83),
}
"""Materials of finishes that only some spaces have; no part of an asset is matched with them."""

MATERIALS.update(FINISHES)

SUPPLIES: dict[str, SurfaceMaterial] = {
    "duct_steel": SurfaceMaterial((0.70, 0.72, 0.74, 1.0), specular=0.5, shininess=0.5, reflectance=0.05),
    "trunking": _satin(0.84, 0.86, 0.87),
    "socket_plate": _satin(0.97, 0.97, 0.96),
    "copper": SurfaceMaterial((0.72, 0.45, 0.30, 1.0), specular=0.6, shininess=0.6),
    "cable_black": _matt(0.09, 0.09, 0.10),
    "cable_gray": _matt(0.45, 0.47, 0.49),
    "hose_red": _matt(0.62, 0.20, 0.15),
    "hose_clear": _glass(0.88, 0.91, 0.92, 0.72),
    "sink_black": _satin(0.13, 0.14, 0.15),
}
"""Materials of ducts, sockets, cables and hoses, which only the scenes of floors with services have."""

MATERIALS.update(SUPPLIES)

COATINGS = {
    "yellow": "safety_yellow",
    "red": "safety_red",
    "orange": "safety_orange",
    "green": "signal_green",
    "blue": "cabinet_blue",
    "white": "cabinet_white",
    "grey": "powder_grey",
    "dark": "powder_dark",
    "black": "plastic_black",
    "purple": "poison_purple",
}
"""Material that a color word of a shape parameter stands for."""

SUBSTANCES = {
    "glass": "borosilicate",
    "porcelain": "porcelain",
    "plastic": "plastic_white",
    "steel": "stainless",
    "wood": "oak",
    "cork": "cork",
    "ptfe": "ptfe",
}
"""Material that a substance word of a shape parameter stands for."""


def coating(color: str) -> str:
    """Return the material of a painted or plastic surface of that color.

    Raises:
        UnknownNameError: no color has that name.
    """
    check_name("colour", color, COATINGS)
    return COATINGS[color]


def substance(word: str) -> str:
    """Return the material for objects of that substance.

    Raises:
        UnknownNameError: no substance has that name.
    """
    check_name("substance", word, SUBSTANCES)
    return SUBSTANCES[word]
