"""A catalog asset as a USD layer: geometry, materials (UsdPreviewSurface), physics, semantic labels and attributes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from labgym.assets.archive import convex_bodies
from labgym.assets.articulation import State, posed_parts, posed_solids
from labgym.assets.meshes.colors import to_linear
from labgym.assets.model import Asset
from labgym.assets.shapes import MATERIALS, Part, build
from labgym.assets.textures import Texture, texture
from labgym.assets.usd.attributes import write_attributes
from labgym.assets.usd.bodies import write_collider, write_convex, write_part
from labgym.errors import optional_package


def write_look(stage: Any, path: str, name: str, file: str | None = None) -> Any:
    """Define the material of a name in `MATERIALS` at a path and return it.

    Args:
        file: image of its texture, relative to the layer; meshes need texture coordinates `st` for it.
    """
    from pxr import Gf, Sdf, UsdShade

    look = MATERIALS[name]
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = [round(to_linear(channel), 4) for channel in look.rgba[:3]]
    diffuse = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    if file is None:
        diffuse.Set(Gf.Vec3f(*color))
    else:
        diffuse.ConnectToSource(_image(stage, path, file).CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    if look.emission:
        glow = [round(look.emission * channel, 4) for channel in color]
        shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*glow))
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.9 if look.reflectance > 0.1 else 0.0)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(look.rgba[3])
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(round(1.0 - 0.9 * look.shininess, 4))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def _image(stage: Any, path: str, file: str) -> Any:
    """Define the shaders that look up an image at the texture coordinates `st`, and return the last."""
    from pxr import Sdf, UsdShade

    place = UsdShade.Shader.Define(stage, f"{path}/Place")
    place.CreateIdAttr("UsdPrimvarReader_float2")
    place.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    image = UsdShade.Shader.Define(stage, f"{path}/Image")
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(file))
    image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
    for axis in ("wrapS", "wrapT"):
        image.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("repeat")
    coordinates = place.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(coordinates)
    return image


def write_labels(prim: Any, labels: Mapping[str, str]) -> None:
    """Apply a `UsdSemantics.LabelsAPI` to a prim for each taxonomy and its label."""
    from pxr import UsdSemantics

    for taxonomy, label in labels.items():
        UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([label])


UNPAINTED: Mapping[str, str] = MappingProxyType({})
"""No material is replaced."""


def asset_layer(asset: Asset, state: State = (), painted: Mapping[str, str] = UNPAINTED, images: str = "") -> Any:
    """Return an asset as an anonymous `pxr.Sdf.Layer` with the same content on every machine.

    The default prim is a component in meters, z up, with its origin at the center of the asset's bottom face and its
    front along +y. Its children are Geometry (visible parts with bound materials), Colliders (the boxes of
    `Asset.solids`, or the convex bodies of an imported mesh; purpose guide) and Looks. The prim is a rigid body of the
    asset's mass; facilities are kinematic, so that they do not move. Its semantic labels are the asset's name
    (taxonomy `class`) and category (taxonomy `category`).

    Args:
        state: of the moving parts, which belong to the rigid body; see `labgym.assets.articulation`.
        painted: materials that replace others.
        images: folder of the images of textured materials, relative to the layer's; without it colors are even.

    Raises:
        MissingDependencyError: usd-core is not installed.
    """
    layer, stage = new_layer(asset.name)
    parts = posed_parts(asset, state) if state else build(asset)
    _write(stage, asset, state, repainted(parts, painted), images)
    return layer


def repainted(parts: Sequence[Part], painted: Mapping[str, str]) -> list[Part]:
    """Return parts with other materials in place of some."""
    return [replace(part, material=painted.get(part.material, part.material)) for part in parts]


def new_layer(name: str) -> tuple[Any, Any]:
    """Return an anonymous `pxr.Sdf.Layer` and a stage of it in meters and kilograms, z up.

    Raises:
        MissingDependencyError: usd-core is not installed.
    """
    with optional_package("usd-core", "writing USD", "usd"):
        from pxr import Sdf, Usd, UsdGeom, UsdPhysics
    # A stage alone would not keep its layer alive.
    layer = Sdf.Layer.CreateAnonymous(name)
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    return layer, stage


def define_asset(stage: Any, asset: Asset) -> Any:
    """Define the default prim of an asset's stage with its labels and attributes, and return it."""
    from pxr import Usd, UsdGeom

    root = UsdGeom.Xform.Define(stage, f"/{asset.name}").GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("component")
    Usd.ModelAPI(root).SetAssetName(asset.name)
    write_labels(root, {"class": asset.name, "category": asset.category})
    write_attributes(root, asset)
    return root


Looks = Mapping[str, tuple[Any, Texture | None]]
"""Materials in a stage, and their textures, by name."""


def write_looks(stage: Any, path: str, parts: Sequence[Part], images: str = "") -> Looks:
    """Define the materials of parts under a path and return them with their textures by name.

    Args:
        images: folder of the images of textured materials, relative to the layer's; without it colors are even.
    """
    from pxr import UsdGeom

    UsdGeom.Scope.Define(stage, path)
    names = sorted({part.material for part in parts})
    textures = {name: texture(name) if images else None for name in names}
    files = {name: f"{images}/{name}.png" for name, image in textures.items() if image is not None}
    return {name: (write_look(stage, f"{path}/{name}", name, files.get(name)), textures[name]) for name in names}


def write_geometry(stage: Any, path: str, parts: Sequence[Part], looks: Looks) -> None:
    """Define the prims of parts under a path, bound to their materials."""
    from pxr import UsdGeom, UsdShade

    UsdGeom.Scope.Define(stage, path)
    for k, part in enumerate(parts):
        material, image = looks[part.material]
        prim = write_part(stage, f"{path}/{part.material}_{k}", part, image)
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def _write(stage: Any, asset: Asset, state: State, parts: Sequence[Part], images: str) -> None:
    from pxr import UsdGeom, UsdPhysics

    root = stage.DefinePrim(f"/{asset.name}", "Xform")
    body = UsdPhysics.RigidBodyAPI.Apply(root)
    if asset.kind == "facility":
        body.CreateKinematicEnabledAttr(True)
    UsdPhysics.MassAPI.Apply(root).CreateMassAttr(asset.mass)
    define_asset(stage, asset)
    looks = write_looks(stage, f"/{asset.name}/Looks", parts, images)
    write_geometry(stage, f"/{asset.name}/Geometry", parts, looks)
    UsdGeom.Scope.Define(stage, f"/{asset.name}/Colliders").CreatePurposeAttr(UsdGeom.Tokens.guide)
    bodies = convex_bodies(asset)
    for k, (vertices, faces) in enumerate(bodies):
        write_convex(stage, f"/{asset.name}/Colliders/convex_{k}", vertices, faces)
    solids = posed_solids(asset, state) if state else asset.solids()
    for k, box in enumerate(() if bodies else solids):
        write_collider(stage, f"/{asset.name}/Colliders/box_{k}", box)
