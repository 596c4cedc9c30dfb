"""The annotation engine: mesh files become catalog entries in four phases, physical, semantic, domain and caption."""

from labgym.assets.forge.engine import Annotated, Options, annotate
from labgym.assets.forge.modelled import Annotator, Described
from labgym.assets.forge.record import CONFIDENCE, Annotation, Origin
from labgym.assets.forge.store import DEFAULT_FOLDER, Addition, Outcome, OwnAssets, mesh_files

__all__ = [
    "CONFIDENCE",
    "DEFAULT_FOLDER",
    "Addition",
    "Annotated",
    "Annotation",
    "Annotator",
    "Described",
    "Options",
    "Origin",
    "Outcome",
    "OwnAssets",
    "annotate",
    "mesh_files",
]
