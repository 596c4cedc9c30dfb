"""Compile layouts: MJCF, USD and GLB scenes, triangle meshes, rays and pictures."""

from labgym.scenes.contacts import Contact, contacts
from labgym.scenes.exact_rays import ExactRayScene
from labgym.scenes.files import write_glb, write_mjcf
from labgym.scenes.mesh import SceneMesh, scene_mesh
from labgym.scenes.mjcf import to_mjcf
from labgym.scenes.opengl import MissingRendererError, Quality, make_renderer
from labgym.scenes.rays import RayScene
from labgym.scenes.render import asset_sheet, render
from labgym.scenes.usd import write_usd
from labgym.scenes.views import View, views

__all__ = [
    "Contact",
    "ExactRayScene",
    "MissingRendererError",
    "Quality",
    "RayScene",
    "SceneMesh",
    "View",
    "asset_sheet",
    "contacts",
    "make_renderer",
    "render",
    "scene_mesh",
    "to_mjcf",
    "views",
    "write_glb",
    "write_mjcf",
    "write_usd",
]
