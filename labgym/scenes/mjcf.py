"""A layout as a MuJoCo model specification: one body for each placement, with visible and solid geoms."""

from __future__ import annotations

import hashlib
import math
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.assets.archive import convex_bodies
from labgym.assets.articulation import State, posed_solids
from labgym.assets.shapes import MATERIALS, Part
from labgym.assets.shapes.parts import Point, Primitive, Vector, local_mesh
from labgym.assets.textures import Texture, corner_coordinates, texture
from labgym.errors import OptionError
from labgym.geometry import OrientedBox
from labgym.layouts import Layout
from labgym.layouts.floor import Finishes, Floor
from labgym.scenes.building import building_patches, building_solids, floor_patches
from labgym.scenes.castors import about_z
from labgym.scenes.finishes import METALS, finishes_at
from labgym.scenes.fittings import drawn_asset, installations
from labgym.scenes.interactive import add_moving_scene
from labgym.scenes.mesh import asset_mesh
from labgym.scenes.patches import Array, Faces
from labgym.scenes.views import View, views

VISUAL_GROUP = 2
COLLISION_GROUP = 3
TILE = 0.6
"""Spacing of the grid that a viewer draws on the floor, meters."""
BRANCH_BODIES = 50
"""Number of bodies that are built in a separate specification, a branch, before they are attached to the scene.
MuJoCo lists the whole tree again for each geom that is added to it, so the cost would grow with the square."""
BRANCH_PREFIX = "~"
"""Prefix that names have for a moment while a branch is attached; MuJoCo warns of an empty one."""
LAMP_DISTANCE = 10.0
"""Distance of the lights from the middle of the floor, meters; over large floors of several rooms it is larger."""
LAMPS = (
    ("sun", (0.16, 0.22, -0.96), (0.26, 0.255, 0.24), 0.10),
    ("fill_front", (-0.70, 0.65, -0.25), (0.35, 0.35, 0.36), 0.05),
    ("fill_left", (0.90, 0.25, -0.25), (0.27, 0.27, 0.26), 0.05),
    ("fill_back", (0.15, -0.90, -0.25), (0.27, 0.27, 0.28), 0.04),
)
"""Name, direction, color and highlight of each light; only the sun, which is steep, casts shadows."""
_GEOMS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


def to_mjcf(
    layout: Layout, visible: bool = True, interactive: bool = False, loose: bool = False, cameras: bool = True
) -> mujoco.MjSpec:
    """Compile a layout into an MJCF specification, without a robot: attach one with `spec.attach`.

    Each placement is a static body named by its id, at the layout's pose. Its visible parts are geoms of group 2 that
    collide with nothing. Its solids (boxes of `Asset.solids`, or convex bodies of an imported mesh) are geoms of
    group 3 named `<id>/solid/<k>`, hidden in default views. The solids of walls and floor belong to the world body and
    are named `<wall>/solid` and `floor/solid`, where a wall is `wall_<k>/<kind>_<n>` or `column_<k>_<n>`.

    Args:
        visible: whether to include visible parts; without them the model is small and compiles fast.
        interactive: whether drawers, doors and sashes are bodies `<id>/<part>` on joints of that name, whose coordinate
            is the opening in meters or radians, interior doors bodies on hinges, and stools, trolleys, cartons, bins
            and drums free bodies.
        loose: whether objects on surfaces are free bodies too; only for interactive scenes.
        cameras: whether the views of the layout are cameras; choosing them takes half of the time without visible
            parts.

    Raises:
        UnknownNameError: an asset or its shape does not exist.
        OptionError: a placement has the id `world`, which MuJoCo reserves, or `loose` without `interactive`.
    """
    if "world" in layout.by_id:
        raise OptionError(f"placement id 'world' of layout {layout.id!r} is reserved by MuJoCo; rename the placement")
    if loose and not interactive:
        raise OptionError("loose objects need an interactive scene: set interactive as well")
    scene = SpecBuilder(layout.id, visible)
    set_looks(scene.spec, layout.floor)
    scene.add_floor(layout.floor, leaves=not interactive)
    if interactive:
        add_moving_scene(scene, layout, loose)
    for placement in () if interactive else layout.placements:
        asset, finishes = drawn_asset(layout, placement.id), finishes_at(layout.floor, *placement.position[:2])
        scene.add_asset(placement.id, asset, placement.position, placement.yaw, finishes, placement.state)
    scene.add_installations(layout)
    for name, view in views(layout).items() if cameras else ():
        add_camera(scene.spec, name, view)
    scene.attach_branches()
    return scene.spec


class SpecBuilder:
    """A specification under construction; meshes and materials are added once.

    Bodies join it with `attach_branches`; before that they can be changed, but not found by their names.
    """

    def __init__(self, name: str, visible: bool = True) -> None:
        self.spec = mujoco.MjSpec()
        self.spec.modelname = name
        self.visual = self.spec.add_default("visual", self.spec.default)
        self.visual.geom.contype, self.visual.geom.conaffinity, self.visual.geom.group = 0, 0, VISUAL_GROUP
        self.solid = self.spec.add_default("solid", self.spec.default)
        self.solid.geom.group, self.solid.geom.rgba = COLLISION_GROUP, [0.4, 0.6, 0.8, 0.4]
        self.visible = visible
        self._names: set[str] = set()
        self._branches: list[mujoco.MjSpec] = []
        self._branch_bodies = 0

    def add_body(self, name: str, position: Vector, yaw: float) -> mujoco.MjsBody:
        """Add a body to the world, turned about z, and return it."""
        if self._branch_bodies % BRANCH_BODIES == 0:
            self._branches.append(mujoco.MjSpec())
        self._branch_bodies += 1
        return self._branches[-1].worldbody.add_body(name=name, pos=position, quat=about_z(yaw))

    def attach_branches(self) -> None:
        """Attach the bodies that were added to the specification, in their order."""
        world = self.spec.worldbody
        for branch in self._branches:
            self.spec.attach(branch, frame=world.add_frame(), prefix=BRANCH_PREFIX)
            for body in branch.bodies:
                self._adopt(body)
            self.spec.delete(self.spec.find_default(f"{BRANCH_PREFIX}main"))
        self._branches, self._branch_bodies = [], 0

    def _adopt(self, body: mujoco.MjsBody) -> None:
        """Give a body of an attached branch, its geoms and joints the names and default classes of this scene."""
        for element in (body, *body.joints):
            element.name, element.classname = element.name.removeprefix(BRANCH_PREFIX), self.spec.default
        for geom in body.geoms:
            geom.classname = self.visual if geom.group == VISUAL_GROUP else self.solid
            for reference in ("name", "material", "meshname"):
                if prefixed := getattr(geom, reference):
                    setattr(geom, reference, prefixed.removeprefix(BRANCH_PREFIX))

    def add_floor(self, floor: Floor, leaves: bool = True) -> None:
        """Add floor, walls, doors, windows and columns to the world body, with or without leaves of interior doors."""
        (x, y), (width, depth) = _extent(floor)
        half, middle = [width / 2.0, depth / 2.0, TILE], [x, y, 0.0]
        plane = mujoco.mjtGeom.mjGEOM_PLANE
        self.spec.worldbody.add_geom(self.solid, name="floor/solid", type=plane, size=half, pos=middle)
        if self.visible:
            for patch in (*floor_patches(floor), *building_patches(floor, leaves)):
                self.add_faces(patch.name, patch.material, patch.vertices, patch.faces)
        for wall, box in building_solids(floor, leaves).items():
            self.add_solid(self.spec.worldbody, f"{wall}/solid", box)

    def add_installations(self, layout: Layout) -> None:
        """Add the visible installations of a layout to the world body, one geom for each material of each."""
        for installation in installations(layout) if self.visible else ():
            for patch in installation.patches:
                self.add_faces(patch.name, patch.material, patch.vertices, patch.faces)

    def add_asset(
        self,
        name: str,
        asset: Asset,
        position: Vector,
        yaw: float,
        finishes: Finishes = Finishes(),  # noqa: B008 (a frozen record)
        state: State = (),
    ) -> None:
        """Add an asset as a static body with visible parts, in the finishes of its space, and solid boxes.

        Args:
            state: of its moving parts.
        """
        body = self.add_body(name, position, yaw)
        _set_inertia(body, asset)
        for part in asset_mesh(asset, finishes, state).parts if self.visible else ():
            self.add_part(body, part)
        bodies = convex_bodies(asset)
        for k, (vertices, faces) in enumerate(bodies):
            self.add_convex(body, f"{name}/solid/{k}", vertices, faces)
        solids = posed_solids(asset, state) if state else asset.solids()
        for k, solid in enumerate(() if bodies else solids):
            self.add_solid(body, f"{name}/solid/{k}", solid)

    def add_part(self, body: mujoco.MjsBody, part: Part) -> None:
        """Add a visible part to a body."""
        geom = body.add_geom(
            self.visual, pos=part.position, quat=part.quaternion, material=self._material(part.material)
        )
        if part.primitive in _GEOMS:
            x, y, z = part.size[0] / 2.0, part.size[1] / 2.0, part.size[2] / 2.0
            geom.type = _GEOMS[part.primitive]
            geom.size = {"cylinder": [x, z, 0.0], "capsule": [x, z - x, 0.0]}.get(part.primitive, [x, y, z])
        else:
            geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, self._swept(part)

    def add_solid(self, body: mujoco.MjsBody, name: str, box: OrientedBox) -> None:
        """Add a solid box, in the body's frame."""
        body.add_geom(
            self.solid,
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[box.x, box.y, (box.z0 + box.z1) / 2.0],
            quat=about_z(box.yaw),
            size=[box.width / 2.0, box.depth / 2.0, (box.z1 - box.z0) / 2.0],
        )

    def add_convex(self, body: mujoco.MjsBody, name: str, vertices: Array, faces: Faces) -> None:
        """Add a solid convex mesh, in the body's frame."""
        mesh = f"convex_{_content_hash(vertices, faces)}"
        if mesh not in self._names:
            self._mesh(mesh, vertices, faces)
        body.add_geom(self.solid, name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh)

    def add_faces(
        self, name: str, material: str, vertices: Array, faces: Faces, normals: NDArray[np.float32] | None = None
    ) -> None:
        """Add visible faces to the world body.

        Args:
            normals: unit normals of the corners of faces, shape (m, 3, 3); by default those that MuJoCo computes.
        """
        if normals is not None:  # MuJoCo reads a normal for each vertex: each corner of a face becomes one
            vertices, faces = vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
        self._mesh(name, vertices, faces, self._texture(material))
        if normals is not None:
            self.spec.mesh(name).usernormal = normals.ravel()
        self.spec.worldbody.add_geom(
            self.visual,
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            material=self._material(material, unwrapped=True),
        )

    def _swept(self, part: Part) -> str:
        """Return the name of the mesh of a revolve, prism or imported part; equal parts share a mesh."""
        if part.triangles is None:
            content = _profile_hash(part.primitive, part.size, part.profile)
        else:
            content = _content_hash(*part.triangles)
        name = f"{part.primitive}_{content}"
        if name not in self._names:
            self._mesh(name, *(part.triangles or local_mesh(part.primitive, part.size, part.profile)))
        return name

    def _mesh(self, name: str, vertices: Array, faces: Faces, image: Texture | None = None) -> None:
        self._names.add(name)
        # No body gets its mass from its meshes: a shell needs no closed volume.
        shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        mesh = self.spec.add_mesh(name=name, uservert=vertices.ravel(), userface=faces.ravel(), inertia=shell)
        if image is not None:
            mesh.usertexcoord = corner_coordinates(vertices, faces, image).ravel()
            mesh.userfacetexcoord = np.arange(faces.size)

    def _texture(self, name: str) -> Texture | None:
        """Return the texture of a material; streaks of metal would be stretched over round parts."""
        return texture(name) if name not in METALS else None

    def _material(self, name: str, unwrapped: bool = False) -> str:
        """Return the name of a material, for meshes with texture coordinates or for other geoms."""
        image, look = self._texture(name), MATERIALS[name]
        key = f"{name}/unwrapped" if image is not None and unwrapped else name
        if key in self._names:
            return key
        self._names.add(key)
        material = self.spec.add_material(
            name=key,
            rgba=look.rgba,
            specular=look.specular,
            shininess=look.shininess,
            reflectance=look.reflectance,
            emission=look.emission,
        )
        if image is not None:
            self._add_texture(image)
            material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = image.name
            material.rgba = [1.0, 1.0, 1.0, look.rgba[3]]
            # Without texture coordinates MuJoCo projects the texture along the z axis of the geom.
            material.texuniform = not unwrapped
            material.texrepeat = [1.0, 1.0] if unwrapped else [1.0 / image.period, 1.0 / image.period]
        return key

    def _add_texture(self, image: Texture) -> None:
        file = f"{image.name}.png"
        if file not in self.spec.assets:
            self.spec.assets = {**self.spec.assets, file: image.png}
            self.spec.add_texture(name=image.name, type=mujoco.mjtTexture.mjTEXTURE_2D, file=file)


def looks_of(material: str) -> str:
    """Return the key of `MATERIALS` from which a material of a specification was made, or its own name."""
    return material.partition("/")[0]


def set_looks(spec: mujoco.MjSpec, floor: Floor) -> None:
    """Set lights, sky and rendering quality."""
    (middle_x, middle_y), (width, depth) = _extent(floor)
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = 2560, 1440
    visual.quality.shadowsize, visual.quality.offsamples = 4096, 8
    visual.headlight.ambient = [0.46, 0.46, 0.47]
    visual.headlight.diffuse = [0.08, 0.08, 0.08]
    visual.headlight.specular = [0.05, 0.05, 0.05]
    visual.map.znear, visual.map.zfar, visual.map.shadowclip = 0.005, 30.0, 2.0
    visual.rgba.haze = [0.88, 0.91, 0.94, 1.0]
    spec.stat.center = [middle_x, middle_y, 0.8]
    spec.stat.extent = math.hypot(width, depth) / 2.0
    distance = max(LAMP_DISTANCE, spec.stat.extent)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.95, 0.97],
        rgb2=[0.66, 0.72, 0.79],
        width=512,
        height=3072,
    )
    for name, direction, diffuse, specular in LAMPS:
        x, y, z = direction
        spec.worldbody.add_light(
            name=name,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=[middle_x - distance * x, middle_y - distance * y, -distance * z],
            dir=_unit(x, y, z),
            diffuse=diffuse,
            specular=[specular] * 3,
            castshadow=name == "sun",
        )


def _extent(floor: Floor) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the middle (x, y), and width and depth, of a floor with its walls."""
    x0, y0, x1, y1 = floor.bounds
    return ((x0 + x1) / 2.0, (y0 + y1) / 2.0), (x1 - x0, y1 - y0)


def add_camera(spec: mujoco.MjSpec, name: str, view: View) -> None:
    """Add a fixed camera to the world."""
    spec.worldbody.add_camera(name=name, pos=view.position, fovy=view.fovy, quat=_quaternion(view.axes().T))


def _set_inertia(body: mujoco.MjsBody, asset: Asset) -> None:
    """Set mass and inertia to those of a uniform bounding box, for scenes in which placements move."""
    w, d, h = asset.size.width, asset.size.depth, asset.size.height
    body.explicitinertial = True
    body.mass, body.ipos = asset.mass, [0.0, 0.0, h / 2.0]
    body.inertia = [asset.mass / 12.0 * (a * a + b * b) for a, b in ((d, h), (w, h), (w, d))]


@lru_cache(maxsize=4096)
def _profile_hash(primitive: Primitive, size: Vector, profile: tuple[Point, ...]) -> str:
    return hashlib.sha256(repr((primitive, size, profile)).encode()).hexdigest()[:12]


def _content_hash(vertices: Array, faces: Faces) -> str:
    return hashlib.sha256(vertices.tobytes() + faces.tobytes()).hexdigest()[:12]


def _quaternion(rotation: Array) -> list[float]:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    return [float(value) for value in quaternion]


def _unit(x: float, y: float, z: float) -> list[float]:
    norm = math.sqrt(x * x + y * y + z * z)
    return [x / norm, y / norm, z / norm]
