"""Mesh files of every format: read into metres with z up, whatever their unit, axes, transforms and instances."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
import trimesh

from labgym.assets.meshes import FORMATS, MeshFile, read_mesh

CUBE_POINTS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
CUBE_QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def usd(body: str, head: str = 'defaultPrim = "Thing" metersPerUnit = 1 upAxis = "Z"') -> str:
    lines = head.replace(" metersPerUnit", "\n metersPerUnit").replace(" upAxis", "\n upAxis")
    return f"#usda 1.0\n(\n {lines}\n)\n{body}\n"


def cube(name: str = "Body", extra: str = "", points=CUBE_POINTS) -> str:
    counts = [4] * 6
    corners = [corner for quad in CUBE_QUADS for corner in quad]
    return (
        f'def Mesh "{name}" {{\n int[] faceVertexCounts = {counts}\n int[] faceVertexIndices = {corners}\n'
        f" point3f[] points = [{', '.join(map(str, map(tuple, points)))}]\n {extra}\n}}\n"
    )


def thing(body: str, extra: str = "") -> str:
    return f'def Xform "Thing" {{\n{extra}\n{body}\n}}'


def write(path, text):
    path.write_text(text)
    return path


def volume(mesh: MeshFile) -> float:
    return sum(float(trimesh.Trimesh(part.vertices, part.faces).volume) for part in mesh.parts)


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".glb", ".usda"])
def test_a_box_is_the_same_box_in_every_format(tmp_path, suffix):
    box = trimesh.creation.box(extents=(0.2, 0.3, 0.5))
    if suffix == ".usda":
        half = np.array((0.1, 0.15, 0.25))
        points = [tuple((2 * np.array(p) - 1) * half) for p in CUBE_POINTS]
        path = write(tmp_path / "box.usda", usd(thing(cube(points=[tuple(map(float, p)) for p in points]))))
        mesh = read_mesh(path)
    else:
        path = tmp_path / f"box{suffix}"
        box.export(path)
        mesh = read_mesh(path, unit="m", up="Z")
    np.testing.assert_allclose(mesh.bounds, [[-0.1, -0.15, -0.25], [0.1, 0.15, 0.25]], atol=1e-7)
    assert volume(mesh) == pytest.approx(0.2 * 0.3 * 0.5, rel=1e-6)


def test_every_format_that_is_offered_has_a_default_unit_that_the_file_can_overrule(tmp_path):
    assert set(FORMATS) == {".usd", ".usda", ".usdc", ".usdz", ".glb", ".obj", ".stl"}
    stl = tmp_path / "box.stl"
    trimesh.creation.box(extents=(200, 300, 500)).export(stl)
    mesh = read_mesh(stl)
    assert (mesh.source_unit, mesh.unit_from) == ("mm", "format default")
    np.testing.assert_allclose(np.ptp(mesh.bounds, axis=0), [0.2, 0.3, 0.5], rtol=1e-6)
    inches = read_mesh(stl, unit="in")
    assert (inches.source_unit, inches.unit_from) == ("in", "option")
    np.testing.assert_allclose(np.ptp(inches.bounds, axis=0), [200 * 0.0254, 300 * 0.0254, 500 * 0.0254], rtol=1e-6)


@pytest.mark.cases(2)
@pytest.mark.parametrize("scale, name", [(0.01, "cm"), (0.001, "mm"), (0.0254, "in"), (1.0, "m"), (0.02, "0.02 m")])
def test_a_stage_says_its_unit_itself(tmp_path, scale, name):
    head = f'defaultPrim = "Thing" metersPerUnit = {scale} upAxis = "Z"'
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing(cube()), head)))
    assert (mesh.source_unit, mesh.unit_from) == (name, "file metadata")
    np.testing.assert_allclose(np.ptp(mesh.bounds, axis=0), [scale] * 3, rtol=1e-6)


def test_a_stage_without_a_unit_is_in_centimetres_as_the_standard_has_it(tmp_path):
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing(cube()), 'defaultPrim = "Thing"')))
    assert (mesh.source_unit, mesh.unit_from, mesh.up_axis) == ("cm", "format default", "Y")


def test_y_up_becomes_z_up(tmp_path):
    points = [(2.0 * x, 3.0 * y, 5.0 * z) for x, y, z in CUBE_POINTS]
    head = 'defaultPrim = "Thing" metersPerUnit = 1 upAxis = "Y"'
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing(cube(points=points)), head)))
    np.testing.assert_allclose(mesh.bounds, [[0, -5, 0], [2, 0, 3]], atol=1e-6)
    assert volume(mesh) == pytest.approx(30.0)


def test_transforms_of_all_ancestors_apply_in_order(tmp_path):
    turn = (
        "double3 xformOp:rotateXYZ = (0, 0, 90)\n float3 xformOp:scale = (2, 1, 1)\n"
        ' uniform token[] xformOpOrder = ["xformOp:rotateXYZ", "xformOp:scale"]\n'
    )
    inner = f'def Xform "Turn" {{\n {turn}{cube()}}}'
    outer = 'double3 xformOp:translate = (10, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing(inner, outer))))
    # Scaled to 2 along x, turned to y, moved to 10: by hand.
    np.testing.assert_allclose(mesh.bounds, [[9, 0, 0], [10, 2, 1]], atol=1e-6)


def test_a_mirrored_mesh_still_faces_outwards(tmp_path):
    mirror = 'float3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing(cube(), mirror))))
    assert volume(mesh) == pytest.approx(1.0)
    left = read_mesh(write(tmp_path / "b.usda", usd(thing(cube(extra='uniform token orientation = "leftHanded"')))))
    assert volume(left) == pytest.approx(-1.0)  # the same winding, said to be the other one


def test_instances_are_written_out(tmp_path):
    places = "".join(
        f'def Xform "At{k}" (instanceable = true\n references = </Prototype>) {{\n'
        f" double3 xformOp:translate = ({3 * k}, 0, 0)\n"
        ' uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
        for k in range(3)
    )
    text = usd('class Xform "Prototype" {\n' + cube() + "}\n" + thing(places))
    mesh = read_mesh(write(tmp_path / "a.usda", text))
    assert len(mesh.parts) == 3
    np.testing.assert_allclose(mesh.bounds, [[0, 0, 0], [7, 1, 1]], atol=1e-6)


def test_solids_are_as_large_as_their_formulas_say(tmp_path):
    body = """
def Cube "A" { double size = 2
}
def Sphere "B" { double radius = 1
}
def Cylinder "C" { double radius = 0.5
 double height = 4
 uniform token axis = "X"
}
def Cone "D" { double radius = 0.5
 double height = 6
 uniform token axis = "Y"
}
def Capsule "E" { double radius = 0.25
 double height = 2
 uniform token axis = "Z"
}
"""
    parts = {part.name: part for part in read_mesh(write(tmp_path / "a.usda", usd(thing(body)))).parts}
    extents = {name: np.ptp(part.vertices, axis=0) for name, part in parts.items()}
    for name, expected in {
        "A": (2, 2, 2),
        "B": (2, 2, 2),
        "C": (4, 1, 1),
        "D": (1, 6, 1),
        "E": (0.5, 0.5, 2.5),
    }.items():
        np.testing.assert_allclose(extents[name], expected, rtol=0.02)
    expected = {"A": 8, "B": 4 / 3 * np.pi, "C": np.pi, "D": np.pi / 2, "E": np.pi / 8 + np.pi / 48}
    for name, part in parts.items():
        assert trimesh.Trimesh(part.vertices, part.faces).volume == pytest.approx(expected[name], rel=0.08), name


def test_a_cone_points_along_its_axis(tmp_path):
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing('def Cone "D" { uniform token axis = "Y"\n}'))))
    vertices = mesh.parts[0].vertices
    assert len(np.unique(vertices[vertices[:, 1] > 0.99], axis=0)) == 1


def test_what_a_renderer_does_not_show_is_left_out(tmp_path):
    hidden = cube("Hidden", 'token visibility = "invisible"') + cube("Guide", 'uniform token purpose = "guide"')
    proxy = 'def Xform "Stand" { uniform token purpose = "proxy"\n' + cube("In") + "}"
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing(cube("Shown") + hidden + proxy))))
    assert [part.name for part in mesh.parts] == ["Shown"]


def test_polygons_are_cut_into_triangles_that_keep_their_area(tmp_path):
    # An L of six corners, as one polygon: its area is 3.
    points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)]
    topology = "int[] faceVertexCounts = [6]\n int[] faceVertexIndices = [0,1,2,3,4,5]"
    body = f'def Mesh "L" {{\n {topology}\n point3f[] points = {points}\n}}'
    part = read_mesh(write(tmp_path / "a.usda", usd(thing(body)))).parts[0]
    flat = trimesh.Trimesh(part.vertices, part.faces, process=False)
    assert len(part.faces) == 4
    assert flat.area == pytest.approx(3.0)
    assert (flat.face_normals[:, 2] > 0.99).all()
    obj = write(tmp_path / "l.obj", "".join(f"v {x} {y} {z}\n" for x, y, z in points) + "f 1 2 3 4 5 -1\n")
    part = read_mesh(obj, up="Z").parts[0]
    assert trimesh.Trimesh(part.vertices, part.faces, process=False).area == pytest.approx(3.0)


LOOKS = """
def Scope "Looks" {
 def Material "Red" {
  token outputs:surface.connect = </Thing/Looks/Red/Shader.outputs:surface>
  def Shader "Shader" {
   uniform token info:id = "UsdPreviewSurface"
   color3f inputs:diffuseColor = (1, 0, 0)
   float inputs:opacity = 0.5
   token outputs:surface
  }
 }
}
"""
BIND = "rel material:binding = </Thing/Looks/Red>"


def test_colours_come_from_the_bound_material_else_from_the_display_colour(tmp_path):
    text = thing(LOOKS + cube("A", BIND) + cube("B", "color3f[] primvars:displayColor = [(0, 1, 0)]") + cube("C"))
    text = text.replace('def Mesh "A" {', 'def Mesh "A" (prepend apiSchemas = ["MaterialBindingAPI"]) {')
    parts = {part.name: part for part in read_mesh(write(tmp_path / "a.usda", usd(text))).parts}
    assert (parts["A"].material, parts["A"].color) == ("Red", pytest.approx((1.0, 0.0, 0.0, 0.5)))
    assert (parts["B"].material, parts["B"].color) == (None, pytest.approx((0.0, 1.0, 0.0, 1.0)))
    assert (parts["C"].material, parts["C"].color) == (None, None)


def test_faces_bound_to_another_material_become_a_part_of_their_own(tmp_path):
    subset = (
        'uniform token subsetFamily:materialBind:familyType = "nonOverlapping"\n'
        'def GeomSubset "Lid" (prepend apiSchemas = ["MaterialBindingAPI"]) {\n uniform token elementType = "face"\n'
        f' uniform token familyName = "materialBind"\n int[] indices = [0, 1]\n {BIND}\n}}'
    )
    parts = read_mesh(write(tmp_path / "a.usda", usd(thing(LOOKS + cube("A", subset))))).parts
    assert {part.name: (len(part.faces), part.material) for part in parts} == {"A/Lid": (4, "Red"), "A": (8, None)}


@pytest.mark.parametrize("present", [True, False])
def test_a_reference_to_a_materialx_file_costs_the_look_and_not_the_geometry(tmp_path, present):
    if present:
        write(tmp_path / "king.mtlx", '<?xml version="1.0"?>\n<materialx version="1.38"></materialx>\n')
    look = 'def Scope "Looks" (references = @./king.mtlx@</MaterialX>) {\n}\n'
    (tmp_path / "parts").mkdir()
    write(tmp_path / "parts" / "leg.usda", usd(thing(look.replace("./", "../") + cube())))
    top = usd(f'def Xform "Thing" {{\n {look} def "Leg" (references = @./parts/leg.usda@) {{\n}}\n}}')
    (part,) = read_mesh(write(tmp_path / "top.usda", top)).parts
    assert len(part.vertices) == 8


def test_files_in_the_same_folder_may_be_referenced_and_packages_too(tmp_path):
    pxr = pytest.importorskip("pxr")
    from pxr import UsdUtils

    assert pxr
    (tmp_path / "parts").mkdir()
    write(tmp_path / "parts" / "leg.usda", usd(thing(cube())))
    top = usd('def Xform "Thing" {\n def "Leg" (references = @./parts/leg.usda@) {\n}\n}')
    path = write(tmp_path / "table.usda", top)
    assert len(read_mesh(path).parts) == 1
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "table.usdz"))
    packed = read_mesh(tmp_path / "table.usdz")
    np.testing.assert_allclose(packed.bounds, read_mesh(path).bounds)


def test_glb_scenes_agree_with_trimesh(tmp_path):
    scene = trimesh.Scene()
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    ball.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(name="amber", baseColorFactor=[255, 0, 0, 128], alphaMode="BLEND")
    )
    for k in range(3):
        matrix = trimesh.transformations.rotation_matrix(0.7 * k, (1, 2, 3)) @ np.diag((1, 1 + k, 1, 1))
        matrix[:3, 3] = (k, 2, 3)
        if k == 0:
            scene.add_geometry(ball, node_name="n0", geom_name="ball", transform=matrix)
        else:
            scene.graph.update(frame_to=f"n{k}", matrix=matrix, geometry="ball")
    path = tmp_path / "balls.glb"
    path.write_bytes(scene.export(file_type="glb"))
    mesh = read_mesh(path)
    assert (mesh.source_unit, mesh.up_axis, len(mesh.parts)) == ("m", "Y", 3)
    low, high = trimesh.load_scene(path).bounds
    # y up to z up by hand: (x, y, z) -> (x, -z, y).
    np.testing.assert_allclose(mesh.bounds, [[low[0], -high[2], low[1]], [high[0], -low[2], high[1]]], atol=1e-5)
    assert {part.material for part in mesh.parts} == {"amber"}
    assert mesh.parts[0].color == pytest.approx((1.0, 0.0, 0.0, 128 / 255), abs=0.01)
    assert volume(mesh) == pytest.approx(6.0 * ball.volume, rel=1e-4)


def glb(header: dict, binary: bytes = b"") -> bytes:
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize("mode, faces", [(4, 1), (5, 2), (6, 2)])
def test_triangles_strips_and_fans_face_the_same_way(tmp_path, mode, faces):
    square = {
        4: [(0, 0, 0), (1, 0, 0), (1, 1, 0)],
        5: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)],
        6: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    }[mode]
    binary = np.array(square, dtype="<f4").tobytes()
    header = {
        "asset": {"version": "2.0", "generator": "by hand"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(square), "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
        "buffers": [{"byteLength": len(binary)}],
    }
    path = tmp_path / "a.glb"
    path.write_bytes(glb(header, binary))
    mesh = read_mesh(path, up="Z")
    flat = trimesh.Trimesh(mesh.parts[0].vertices, mesh.parts[0].faces, process=False)
    assert mesh.metadata == {"generator": "by hand"}
    assert (len(flat.faces), flat.area) == (faces, pytest.approx(faces / 2))
    assert (flat.face_normals[:, 2] > 0.99).all()


def test_obj_objects_materials_and_colours(tmp_path):
    write(tmp_path / "a.mtl", "newmtl steel\nKd 0.5 0.6 0.7\nd 0.25\n")
    points = "".join(f"v {x} {y} {z}\n" for x, y, z in CUBE_POINTS)
    quads = ["f " + " ".join(f"{c + 1}/1/1" for c in quad) + "\n" for quad in CUBE_QUADS]
    text = (
        f"# a cube\nmtllib a.mtl\n{points}o Box\nusemtl steel\n{quads[0]}{quads[1]}usemtl other\n{''.join(quads[2:])}"
    )
    mesh = read_mesh(write(tmp_path / "a.obj", text))
    looks = [(part.name, part.material, part.color, len(part.faces)) for part in mesh.parts]
    assert looks == [("Box", "steel", (0.5, 0.6, 0.7, 0.25), 4), ("Box", "other", None, 8)]
    assert (mesh.up_axis, mesh.source_unit, mesh.name) == ("Y", "m", "Box")


def test_text_and_binary_stl_are_the_same_mesh(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=1)
    (tmp_path / "text.stl").write_text(ball.export(file_type="stl_ascii"))
    (tmp_path / "binary.stl").write_bytes(ball.export(file_type="stl"))
    text, binary = (read_mesh(tmp_path / f"{kind}.stl", unit="m").parts[0] for kind in ("text", "binary"))
    np.testing.assert_allclose(text.vertices[text.faces], binary.vertices[binary.faces], atol=1e-6)
    assert len(text.vertices) == len(ball.vertices)


def test_custom_text_of_the_default_prim_is_kept_as_metadata(tmp_path):
    mesh = read_mesh(write(tmp_path / "a.usda", usd(thing(cube(), 'custom string labgym:name = "Beaker"'))))
    assert mesh.metadata["labgym:name"] == "Beaker"
