"""LabForge I: the catalog of assets, their chemistry and their shapes."""

from labgym.assets.catalog import AssetFile, Catalog
from labgym.assets.compatibility import Hazard, incompatible, pairs
from labgym.assets.model import (
    SHELL,
    Asset,
    Cavity,
    Chemistry,
    Hazards,
    Kind,
    Shape,
    Size,
    StorageClass,
    Surface,
)
from labgym.assets.search import Match
from labgym.assets.specs import Specifications
from labgym.assets.substances import Substance

__all__ = [
    "SHELL",
    "Asset",
    "AssetFile",
    "Catalog",
    "Cavity",
    "Chemistry",
    "Hazard",
    "Hazards",
    "Kind",
    "Match",
    "Shape",
    "Size",
    "Specifications",
    "StorageClass",
    "Substance",
    "Surface",
    "incompatible",
    "pairs",
]
