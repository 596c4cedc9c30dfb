"""Layers of DXF drawings, named after the U.S. National CAD Standard, and the words by which other names are read."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable
from types import ModuleType

from labgym.errors import optional_package

WALLS = "A-WALL"
WALL_FILL = "A-WALL-PATT"
DOORS = "A-DOOR"
WINDOWS = "A-GLAZ"
COLUMNS = "A-COLS"
SPACES = "A-AREA"
SPACE_TAGS = "A-AREA-IDEN"
FURNITURE = "A-FURN"
EQUIPMENT = "A-EQPM"
SERVICES = "A-FLOR-SERV"
KEEP_OUTS = "A-FLOR-KEEP"
LABELS = "A-ANNO-TEXT"
DIMENSIONS = "A-ANNO-DIMS"

COLORS = {
    WALLS: 7,
    WALL_FILL: 9,
    DOORS: 30,
    WINDOWS: 4,
    COLUMNS: 7,
    SPACES: 8,
    SPACE_TAGS: 8,
    FURNITURE: 5,
    EQUIPMENT: 3,
    SERVICES: 6,
    KEEP_OUTS: 1,
    LABELS: 2,
    DIMENSIONS: 1,
}
"""AutoCAD color index of each layer."""

_WORDS = {
    KEEP_OUTS: r"FLOR-KEEP|KEEP-?OUT",
    SERVICES: r"FLOR-SERV|SERV.{0,10}(?:WATER|GAS|EXHAUST|POWER)",
    SPACE_TAGS: r"AREA-IDEN|SPACE-?TAG|ROOM-?TAG",
    WALL_FILL: r"-PATT|HATCH|SCHRAFF",
    DIMENSIONS: r"ANNO|DIMS?\b|BEMASS|COTES?\b",
    FURNITURE: r"FURN|EQPM|EQUIP|M(?:Ö|OE)BEL|MOBILIER|家具",
    DOORS: r"DOOR|ENTRANCE|T(?:ÜR|UER)|EINGANG|PORTE|ENTR[EÉ]E|PUERTA|ENTRADA|门",
    WINDOWS: r"GLAZ|WINDOW|FENSTER|FEN[EÊ]TRE|VENTANA|窗",
    COLUMNS: r"COLS|COLUMN|ST(?:Ü|UE)TZE|POTEAU|PILLAR|柱",
    SPACES: r"AREA|ROOM|SPACE|RAUM|PI[EÈ]CE|OUTLINE|房间",
    WALLS: r"WALL|W(?:A|Ä|AE)ND|MUR(?:S|O|$|[^A-Z])|PARED|墙",
}
_KINDS = re.compile(r"WATER|GAS|EXHAUST|POWER", re.IGNORECASE)
_PATTERNS = {layer: re.compile(words, re.IGNORECASE) for layer, words in _WORDS.items()}


def service_kind(names: Iterable[str]) -> str | None:
    """Return the kind of service that a layer names, None if none of some layers does."""
    matches = (_KINDS.search(name) for name in names)
    return next((match[0].lower() for match in matches if match), None)


def role(names: Iterable[str], blocks: Iterable[str] = ()) -> str | None:
    """Return the layer of this module that an entity belongs to, None if it belongs to none.

    Args:
        names: its layer, then the layers of the blocks around it; the first that is recognized counts.
        blocks: names of the blocks around it, which count for doors, windows and columns if no layer is recognized.
    """
    for name in names:
        for layer, words in _PATTERNS.items():
            if words.search(name):
                return layer
    for name in blocks:
        for layer in (DOORS, WINDOWS, COLUMNS):
            if _PATTERNS[layer].search(name):
                return layer
    return None


def load_ezdxf() -> ModuleType:
    """Return the module ezdxf, whose log messages are silenced.

    Raises:
        MissingDependencyError: ezdxf is not installed.
    """
    with optional_package("ezdxf", "a DXF drawing", "cad"):
        import ezdxf
    logging.getLogger("ezdxf").setLevel(logging.CRITICAL)
    return ezdxf
