"""The catalog as OpenUSD: one file for each asset, with materials, colliders, mass, labels and hazards."""

from labgym.assets.usd.articulated import BODY, articulated_layer, set_joint
from labgym.assets.usd.attributes import ATTRIBUTES, NAMESPACE
from labgym.assets.usd.bodies import write_collider, write_mesh
from labgym.assets.usd.files import check_files, findings, stray_files, usd_folder, usd_path, write_files, write_layer
from labgym.assets.usd.stages import asset_layer, write_geometry, write_labels, write_look, write_looks

__all__ = [
    "ATTRIBUTES",
    "BODY",
    "NAMESPACE",
    "articulated_layer",
    "asset_layer",
    "check_files",
    "findings",
    "set_joint",
    "stray_files",
    "usd_folder",
    "usd_path",
    "write_collider",
    "write_files",
    "write_geometry",
    "write_labels",
    "write_layer",
    "write_look",
    "write_looks",
    "write_mesh",
]
