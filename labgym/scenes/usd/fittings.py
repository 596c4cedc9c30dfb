"""The installations of a layout as a USD layer: ducts, sockets, cables, hoses, chains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from labgym.assets.usd import write_labels, write_look, write_mesh
from labgym.scenes.fittings import Installation
from labgym.scenes.usd.names import identifiers, write_note
from labgym.scenes.usd.room import connected


def fittings_layer(installations: Sequence[Installation]) -> Any:
    """Return installations as an anonymous `pxr.Sdf.Layer`: a prim for each, without colliders.

    Their semantic class is their kind; `labgym:owner` is the id of the placement that they belong to.
    """
    from pxr import Sdf, Usd, UsdGeom, UsdShade

    layer = Sdf.Layer.CreateAnonymous("fittings")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    root = UsdGeom.Xform.Define(stage, "/Fittings").GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("component")
    UsdGeom.Scope.Define(stage, "/Fittings/Looks")
    materials = sorted({patch.material for each in installations for patch in each.patches})
    looks = {material: write_look(stage, f"/Fittings/Looks/{material}", material) for material in materials}
    names = identifiers([f"{each.owner}_{each.kind}" for each in installations])
    for name, installation in zip(names, installations, strict=True):
        prim = UsdGeom.Xform.Define(stage, f"/Fittings/{name}").GetPrim()
        write_labels(prim, {"class": installation.kind})
        write_note(prim, "owner", installation.owner)
        pieces = [(patch, faces) for patch in installation.patches for faces in connected(patch.faces)]
        for label, (patch, faces) in zip(identifiers([patch.material for patch, _ in pieces]), pieces, strict=True):
            mesh = write_mesh(stage, f"/Fittings/{name}/{label}", patch.vertices, faces)
            UsdShade.MaterialBindingAPI.Apply(mesh).Bind(looks[patch.material])
    return layer
