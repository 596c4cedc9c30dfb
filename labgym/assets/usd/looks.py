"""Materials as UsdPreviewSurface shaders."""

from __future__ import annotations

from typing import Any

from labgym.assets.meshes.colors import to_linear
from labgym.assets.shapes import MATERIALS


def write_look(stage: Any, path: str, name: str) -> Any:
    """Define the material of a name in `MATERIALS` at a path and return it."""
    from pxr import Gf, Sdf, UsdShade

    look = MATERIALS[name]
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = [round(to_linear(channel), 4) for channel in look.rgba[:3]]
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*color))
    if look.emission:
        glow = [round(look.emission * channel, 4) for channel in color]
        shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*glow))
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.9 if look.reflectance > 0.1 else 0.0)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(look.rgba[3])
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(round(1.0 - 0.9 * look.shininess, 4))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material
