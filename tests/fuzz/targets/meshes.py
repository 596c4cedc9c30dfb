"""Mesh files of every format, geometry archives and user catalogs."""

from __future__ import annotations

import io
import json
import resource
import struct
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import trimesh

from fuzz.harness import MAX_GROWTH, memory
from fuzz.mutation import HOSTILE, mutated_bytes, mutated_data, mutated_file, mutated_json, mutated_text, mutated_zip
from fuzz.target import Case, Target, one_file
from labgym.assets import archive
from labgym.assets.catalog import Catalog
from labgym.assets.meshes.model import LIMITS, MeshError
from labgym.assets.meshes.physical import normalize
from labgym.assets.meshes.reading import from_raw, read_mesh
from labgym.errors import LabgymError

MTL = "newmtl steel\nKd 0.5 0.5 0.6\nd 0.9\nnewmtl glass\nKd 1 1 1\nTr 0.5\n"
OBJ = """# a box and a fan
mtllib a.mtl
o Box
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
vn 0 0 1\nvt 0 0
usemtl steel
f 1/1/1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7
g side
usemtl glass
f 2 3 7\nf 2 7 6\nf -8 -4 -1 -5
"""
USDA = """#usda 1.0
(
    defaultPrim = "Thing"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "Thing" (
    variants = { string size = "big" }
    prepend variantSets = "size"
)
{
    double3 xformOp:translate = (0.5, 0, 1)
    float xformOp:rotateZ = 30
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]
    def Mesh "Body" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        int[] faceVertexCounts = [4, 4, 3, 3]
        int[] faceVertexIndices = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 0, 5, 4]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1)]
        int[] holeIndices = [3]
        uniform token orientation = "leftHanded"
        uniform token subdivisionScheme = "none"
        rel material:binding = </Thing/Looks/Steel>
        def GeomSubset "Top"
        {
            int[] indices = [1]
            uniform token elementType = "face"
        }
    }
    def Cube "Block"
    {
        double size = 2
        matrix4d xformOp:transform = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (3, 0, 0, 1) )
        uniform token[] xformOpOrder = ["xformOp:transform"]
    }
    def Sphere "Ball"
    {
        double radius = 0.5
    }
    def Cylinder "Rod"
    {
        double height = 1
        double radius = 0.1
        uniform token axis = "X"
    }
    def "Again" (
        references = </Thing/Body>
        instanceable = true
    )
    {
    }
    variantSet "size" = {
        "big" {
            double3 xformOp:scale = (2, 2, 2)
        }
    }
    def Scope "Looks"
    {
        def Material "Steel"
        {
            token outputs:surface.connect = </Thing/Looks/Steel/S.outputs:surface>
            def Shader "S"
            {
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor = (0.5, 0.5, 0.6)
                float inputs:opacity = 0.8
                token outputs:surface
            }
        }
    }
}
"""


def targets() -> Iterator[Target]:
    """Yield a target for each format."""
    yield Target("mesh obj", lambda: _obj, _read_first)
    yield Target("mesh obj with its bodies", lambda: _obj, _read_bodies, share=0.02)
    yield Target("mesh mtl", lambda: _mtl, _read_first, share=0.5)
    yield Target("mesh stl text", _stl_text, _read_first, share=0.5)
    yield Target("mesh stl binary", _stl_binary, _read_first, share=0.5)
    yield Target("mesh glb container", partial(_glb, False), _read_first, share=0.5)
    yield Target("mesh glb header", partial(_glb, True), _read_first, share=0.5)
    for kind in ("usda", "usdc", "usdz"):
        yield Target(f"mesh {kind} container", partial(_usd, kind, False), _read_stage, ("pxr.UsdGeom",), True, 0.2)
        yield Target(f"mesh {kind} content", partial(_usd, kind, True), _read_stage, ("pxr.UsdGeom",), True, 0.2)
    yield Target("geometry npz container", partial(_npz, False), _unpack, share=0.5)
    yield Target("geometry npz content", partial(_npz, True), _unpack, share=0.5)
    yield Target("catalog folder", _catalog, _load_catalog)


def _read_first(folder: Path) -> None:
    """Read the file of the case as `labgym assets add` does."""
    (path,) = (path for path in folder.iterdir() if path.suffix != ".mtl")
    read_mesh(path)


def _read_bodies(folder: Path) -> None:
    """Read the file of the case and decompose it, as `labgym assets add` does."""
    normalize(read_mesh(folder / "a.obj"))


def _read_stage(folder: Path) -> None:
    """Read a USD file as the process does that labgym starts for it; that process is this one here."""
    from labgym.assets.meshes.stage import pack, read_stage, unpack

    (path,) = folder.iterdir()
    room = memory("VmSize") + MAX_GROWTH
    resource.setrlimit(resource.RLIMIT_AS, (room, resource.getrlimit(resource.RLIMIT_AS)[1]))
    try:
        content = pack(read_stage(path, LIMITS))
    except LabgymError:
        raise
    except Exception as error:  # noqa: BLE001 - ends the process with status 1, which `read_usd` reports
        raise MeshError(path, f"USD's reader failed on it ({type(error).__name__})") from None
    from_raw(path, unpack(content))


def _obj(rng: Random | None) -> Case:
    return {"a.obj": OBJ.encode() if rng is None else mutated_file(rng, OBJ), "a.mtl": MTL.encode()}


def _mtl(rng: Random | None) -> Case:
    name = "a.mtl" if rng is None or rng.random() < 0.8 else rng.choice(("../a.mtl", "m" * 300, "a\0.mtl", "é.mtl", ""))
    text = MTL.encode() if rng is None else mutated_file(rng, MTL)
    return {"a.obj": OBJ.replace("a.mtl", name).encode(), "a.mtl": text}


def _stl_text() -> Callable[[Random | None], Case]:
    text = trimesh.creation.box().export(file_type="stl_ascii")
    return one_file("a.stl", text.encode(), lambda rng, content: mutated_file(rng, content.decode()))


def _stl_binary() -> Callable[[Random | None], Case]:
    content = trimesh.creation.icosphere(1).export(file_type="stl")

    def make(rng: Random | None) -> Case:
        if rng is None:
            return {"a.stl": content}
        data = mutated_bytes(rng, content)
        if rng.random() < 0.7 and len(data) >= 84:  # a count that fits, so that the triangles are read
            count = (len(data) - 84) // 50
            data = data[:80] + struct.pack("<I", count) + data[84 : 84 + 50 * count]
        return {"a.stl": data}

    return make


def _glb(inside: bool) -> Callable[[Random | None], Case]:
    scene = trimesh.Scene({"a": trimesh.creation.box(), "b": trimesh.creation.icosphere(1)})
    content = scene.export(file_type="glb")
    length = struct.unpack("<I", content[12:16])[0]
    header, rest = json.loads(content[20 : 20 + length]), content[20 + length :]
    header["nodes"][0] |= {"rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0], "translation": [0.0, 0.0, 0.0]}

    def packed(head: bytes, binary: bytes) -> bytes:
        head += b" " * (-len(head) % 4)
        body = struct.pack("<II", len(head), 0x4E4F534A) + head + binary
        return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body

    def make(rng: Random | None) -> Case:
        if rng is None:
            return {"a.glb": content}
        if not inside:
            return {"a.glb": mutated_bytes(rng, content)}
        if rng.random() < 0.2:
            return {
                "a.glb": packed(json.dumps(header).encode(), rest[:8] + mutated_bytes(rng, rest[8:])[: len(rest) - 8])
            }
        return {"a.glb": packed(mutated_json(rng, header), rest)}

    return make


def _usd(kind: str, inside: bool) -> Callable[[Random | None], Case]:
    seed = _exported(USDA, kind)
    assert seed is not None

    def make(rng: Random | None) -> Case:
        content = seed
        if rng is not None and inside:
            changes = (_exported(mutated_text(rng, USDA), kind) for _ in range(20))
            content = next((change for change in changes if change is not None), seed)
        elif rng is not None and kind == "usda":
            content = mutated_file(rng, USDA)
        elif rng is not None:
            zipped = kind == "usdz" and rng.random() < 0.5
            content = mutated_zip(rng, seed) if zipped else mutated_bytes(rng, seed)
        return {f"a.{kind}": content}

    return make


def _exported(text: str, kind: str) -> bytes | None:
    """Return a text as a file of a kind, or None if it is no USD layer."""
    from pxr import Sdf, UsdUtils

    layer = Sdf.Layer.CreateAnonymous(".usda")
    place, package = Path("seed.usdc").absolute(), Path("seed.usdz").absolute()
    try:
        if not layer.ImportFromString(text):
            return None
        layer.Export(str(place))
        UsdUtils.CreateNewUsdzPackage(str(place), str(package))
    except Exception:  # noqa: BLE001 - pxr's own errors
        return None
    if kind == "usda":
        return text.encode("utf-8", "surrogatepass")
    return (package if kind == "usdz" else place).read_bytes()


def _geometry() -> bytes:
    box = trimesh.creation.box((0.4, 0.3, 0.2))
    piece = archive.MeshPiece(box.vertices, box.faces, "steel")
    return archive.pack(archive.Geometry((piece, piece), ((box.vertices, box.faces),)))


def _npz(inside: bool) -> Callable[[Random | None], Case]:
    return one_file("a.npz", _geometry(), _changed_arrays if inside else mutated_bytes)


def _changed_arrays(rng: Random, content: bytes) -> bytes:
    """Return a valid npz file with an array of another type, shape, name or content, or with a broken member."""
    if rng.random() < 0.3:
        return mutated_zip(rng, content)
    arrays: dict[str, Any] = dict(np.load(io.BytesIO(content)))
    name = rng.choice(list(arrays))
    array = arrays.pop(name)
    match rng.randrange(6):
        case 0:
            array = array.astype(rng.choice(("f2", "i1", "u8", "c16", "S3", "?", "M8[s]")))
        case 1:
            array = rng.choice((array.ravel(), array[..., None], array[:0], array.T, np.float64(3.0), np.zeros((0, 3))))
        case 2:
            array = np.resize(np.array([np.nan, np.inf, 1e300, -1e300]), array.shape)
        case 3:
            array = np.frombuffer(json.dumps(rng.choice(HOSTILE), default=str).encode(), np.uint8)
        case 4:
            name = rng.choice(("faces_9", "vertices_0", "materials", "../x", "faces_-1"))
        case 5:
            array = array + rng.choice((-1, 1, 100)) if array.dtype.kind in "if" else array[1:]
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **{**arrays, name: array})
    return stream.getvalue()


def _unpack(folder: Path) -> None:
    archive.unpack((folder / "a.npz").read_bytes(), folder / "a.npz")


def _catalog() -> Callable[[Random | None], Case]:
    content = _geometry()
    digest = archive.digest(content)
    stem = f"FuzzBox-{digest[:12]}"
    published = json.loads(
        (Path(__file__).resolve().parents[3] / "assets/catalog/equipment/glassware.json").read_text()
    )
    asset = next(each for each in published["assets"] if each["kind"] != "reagent")
    asset = asset | {
        "name": "FuzzBox",
        "synonyms_en": [],
        "synonyms_zh": [],
        "size": {"width": 0.4, "depth": 0.3, "height": 0.2},
        "shape": {"name": "mesh", "parameters": {"file": f"meshes/{stem}.npz", "sha256": digest}},
    }
    entry = {"schema": "labgym.assets/1", "assets": [asset]}

    def make(rng: Random | None) -> Case:
        if rng is None:
            return {"assets/FuzzBox.json": json.dumps(entry).encode(), f"meshes/{stem}.npz": content}
        geometry = content if rng.random() < 0.7 else _changed_arrays(rng, content)
        data = mutated_data(rng, entry)
        if geometry != content and rng.random() < 0.7:  # the hash of the changed file, so that it is unpacked
            name = f"meshes/FuzzBox-{archive.digest(geometry)[:12]}.npz"
            asset["shape"]["parameters"] = {"file": name, "sha256": archive.digest(geometry)}
            return {"assets/FuzzBox.json": json.dumps(entry).encode(), name: geometry}
        text = json.dumps(data).encode("utf-8", "surrogatepass")
        return {"assets/FuzzBox.json": text, f"meshes/{stem}.npz": geometry}

    return make


def _load_catalog(folder: Path) -> None:
    """Load a catalog as LABGYM_CATALOG does, and the geometry of its entries as a scene does."""
    catalog = Catalog.load(folder)
    for name in catalog.names:
        asset = catalog.get(name)
        if asset.shape.name == archive.SHAPE:
            archive.geometry(asset)
