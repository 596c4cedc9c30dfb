"""Materials as UsdPreviewSurface shaders."""

from __future__ import annotations

from typing import Any

from labgym.assets.meshes.colors import to_linear
from labgym.assets.shapes import MATERIALS


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
