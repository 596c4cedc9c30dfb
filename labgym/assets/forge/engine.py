"""From a mesh file to a catalog entry: the four phases in order, by rules or with a language model."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from pydantic import ValidationError

from labgym.assets.archive import SHAPE, digest, pack, remember
from labgym.assets.catalog import Catalog
from labgym.assets.checks import kinds_agree, sizes_are_plausible, surfaces_fit, texts_are_complete
from labgym.assets.forge.drafting import EntryDraft, domain, semantic, write_caption
from labgym.assets.forge.facts import Facts, texts
from labgym.assets.forge.looks import geometry_of, look
from labgym.assets.forge.matching import SIZE_RATIO, Resemblance, resemblance
from labgym.assets.forge.modelled import Annotator, drafted, measured, take
from labgym.assets.forge.record import Annotation, MeshSource, Physical
from labgym.assets.forge.scale import check_scale
from labgym.assets.meshes import MeshError, MeshFile, PhysicalMesh, normalize, read_mesh
from labgym.assets.meshes.colors import to_linear
from labgym.assets.meshes.model import LIMITS, Axis
from labgym.assets.model import Asset
from labgym.assets.search import normalize as name_key
from labgym.assets.shapes import MATERIALS
from labgym.documents import document_error

Views = Callable[[Asset], Sequence[bytes]]
"""Returns PNG pictures of an asset; provided by a layer that can render."""
_RULES = (sizes_are_plausible, texts_are_complete, surfaces_fit, kinds_agree)
_Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def glb(mesh: PhysicalMesh) -> bytes:
    """Return a mesh as binary glTF; its front, +y of the asset's frame, looks along -z of glTF."""
    scene = trimesh.Scene()
    for k, part in enumerate(mesh.parts):
        red, green, blue, opacity = part.color or MATERIALS[look(part)].rgba
        body = trimesh.Trimesh(part.vertices, part.faces, process=False)
        body.visual = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
            material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
                name=part.material or look(part),
                baseColorFactor=[round(255 * to_linear(channel)) for channel in (red, green, blue)]
                + [round(255 * opacity)],
                metallicFactor=0.0,
                roughnessFactor=0.6,
                alphaMode="BLEND" if opacity < 1.0 else "OPAQUE",
            )
        )
        scene.add_geometry(body, node_name=f"part_{k}", geom_name=f"part_{k}", transform=_Y_UP)
    content: bytes = scene.export(file_type="glb")  # type: ignore[no-untyped-call]
    return content


@dataclass(frozen=True)
class Options:
    """Options for reading and annotating a mesh file.

    Attributes:
        unit: of the file, such as "mm"; overrides the file's. up: its vertical axis, X, Y or Z; likewise.
        front: direction of the front in the file's axes, such as "-x".
        name: canonical name of the asset. like: published entry, by name or synonym, that the mesh is a model of.
        model: name of the language model that annotates; "" for rules.
        scale: factor applied after the unit.
    """

    unit: str | None = None
    up: Axis | None = None
    front: str | None = None
    name: str | None = None
    like: str | None = None
    model: str = ""
    scale: float | None = None

    def recorded(self) -> dict[str, str]:
        """Return the options that are set, as text."""
        return {name: str(value) for name, value in vars(self).items() if value}


@dataclass(frozen=True)
class Annotated:
    """A new entry with the record of its annotation, its geometry (npz) and its picture for viewers (GLB)."""

    asset: Asset
    annotation: Annotation
    geometry: bytes
    visual: bytes


def source_digest(path: Path) -> str:
    """Return the SHA-256 of a mesh file.

    Raises:
        MeshError: missing, no regular file, or too large.
    """
    if not path.is_file():
        raise MeshError(path, "no such file" if not path.exists() else "not a regular file")
    if path.stat().st_size > LIMITS.bytes:
        raise MeshError(path, f"{path.stat().st_size} bytes, expected at most {LIMITS.bytes}; simplify it")
    return hashlib.sha256(path.read_bytes()).hexdigest()


def annotate(
    path: Path,
    options: Options | None = None,
    catalog: Catalog | None = None,
    annotator: Annotator | None = None,
    views: Views | None = None,
) -> Annotated:
    """Return the catalog entry for a mesh file; the same file and options give the same entry.

    Args:
        path: a USD, GLB, OBJ or STL file.
        catalog: catalog that the mesh is compared with; the published one by default.
        annotator: asks a language model; without one, rules annotate.
        views: renders the draft for the annotator.

    Raises:
        MeshError: an unusable file, or a size that its category does not allow; names the likely unit or scale.
        UnknownNameError: an option names what does not exist.
        MissingDependencyError: a USD file, and usd-core is not installed.
    """
    path, options = Path(path), options or Options()
    published = catalog if catalog is not None else Catalog.published()
    file_digest = source_digest(path)
    file = read_mesh(path, options.unit, options.up, scale=options.scale)
    nearest = _nearest(published, file, path.stem, options.like)
    check_scale(published, file, path.stem, nearest)
    mesh = normalize(file, options.front)
    facts = Facts(path.stem, file_digest, published, file, mesh, nearest, options.name)
    if options.name is not None and name_key(options.name) in facts.taken:
        raise MeshError(path, f"{options.name!r} is a name of a published asset; choose another --name")
    draft = semantic(facts)
    draft.notes += _doubts(facts)
    domain(facts, draft)
    write_caption(draft)
    content = pack(geometry_of(mesh, draft.fields["category"]))
    if annotator is not None:
        remember(content)
        pictures = views(_asset(path, draft, content)) if views is not None else ()
        take(annotator(measured(facts), drafted(draft), pictures), facts, draft)
    asset = _asset(path, draft, content)
    for rule in _RULES:
        for problem in rule(asset):
            raise MeshError(path, f"{problem.field} of {asset.name}: {problem.message}")
    source = MeshSource(
        file=path.name[:200],
        sha256=file_digest,
        source_unit=file.source_unit,
        unit_from=file.unit_from,
        up_axis=file.up_axis,
        up_from=file.up_from,
        options=options.recorded(),
    )
    annotation = Annotation(
        asset=asset.name,
        source=source,
        physical=_physical(mesh),
        resembles=facts.like.name if facts.like else None,
        fields=draft.origins,
        notes=tuple(draft.notes),
    )
    return Annotated(asset, annotation, content, glb(mesh))


def _nearest(published: Catalog, file: MeshFile, stem: str, like: str | None) -> Resemblance | None:
    if like is not None:
        return Resemblance(published.find(like), 1.0, "chosen by the user")
    low, high = file.bounds
    width, depth, height = (float(side) for side in high - low)
    return resemblance(published, texts(file, stem), (width, depth, height))


def _doubts(facts: Facts) -> Iterator[str]:
    """Yield points for the user to check: an assumed up axis, an unusual size, and a coarse collision geometry."""
    file, like = facts.file, facts.like
    width, depth, height = (round(side, 3) for side in (facts.size.width, facts.size.depth, facts.size.height))
    if file.up_from == "format default" and not (width == depth == height):
        other = "Z" if file.up_axis == "Y" else "Y"
        closer = like is not None and _unlike(like, width, height, depth) < _unlike(like, width, depth, height)
        closer_to = f", closer to {like.name}" if like is not None and closer else ""
        yield (
            f"its up axis is not in the file: {file.up_axis} is assumed, so it is {height:g} m high; with --up {other} "
            f"it is {depth:g} m high{closer_to}"
        )
    if like is not None and like.kind != "reagent":
        ratio = max(width, depth, height) / max(like.size.width, like.size.depth, like.size.height)
        if not 1.0 / SIZE_RATIO <= ratio <= SIZE_RATIO:
            yield f"its longest side is {ratio:.2g} times that of {like.name}: check --unit, or give --scale"
    if facts.mesh.note:
        yield facts.mesh.note


def _unlike(like: Asset, width: float, depth: float, height: float) -> float:
    """Return how unlike an entry's an upright shape is: by the ratio of its height to its shorter and longer side."""
    short, long = sorted((width, depth))
    ratios = (height / short, height / long), (like.size.height / like.size.short, like.size.height / like.size.long)
    return math.dist([math.log(ratio) for ratio in ratios[0]], [math.log(ratio) for ratio in ratios[1]])


def _asset(path: Path, draft: EntryDraft, content: bytes) -> Asset:
    name, hashed = str(draft.fields["name"]), digest(content)
    shape: dict[str, Any] = {
        "name": SHAPE,
        "parameters": {"file": f"meshes/{name}-{hashed[:12]}.npz", "sha256": hashed},
    }
    try:
        return Asset.model_validate({**draft.fields, "shape": shape})
    except ValidationError as error:
        raise MeshError(path, f"cannot be an asset: {document_error('entry', error)}") from None


def _physical(mesh: PhysicalMesh) -> Physical:
    return Physical(
        short=mesh.size.short,
        long=mesh.size.long,
        height=mesh.size.height,
        watertight=mesh.watertight,
        volume=mesh.volume,
        parts=len(mesh.parts),
        faces=sum(len(part.faces) for part in mesh.parts),
        convex_bodies=len(mesh.convex),
        decomposed_by=mesh.decomposed_by,
    )
