"""The annotation engine: mesh files become catalog entries in four phases, physical, semantic, domain and caption."""

from labgym.assets.forge.engine import Options, annotate
from labgym.assets.forge.modelled import Annotator, Described
from labgym.assets.forge.record import Annotation
from labgym.assets.forge.store import OwnAssets, mesh_files

__all__ = [
    "Annotation",
    "Annotator",
    "Described",
    "Options",
    "OwnAssets",
    "annotate",
    "mesh_files",
]
