"""Files of other programs: DXF drawings, ROS maps, inventories and LabBuilder scenes."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from fuzz.mutation import mutated_bytes, mutated_file
from fuzz.target import Case, Target
from labgym.exchange.fixed import read_fixed
from labgym.exchange.formats import compile_layout, read_floor
from labgym.exchange.inventory import read_inventory
from labgym.layouts import load_published, published
from labgym.paper.labbuilder.reading import read_labbuilder

TABLE = 'asset,count,note\nrotovap,2,"room 3, left"\nRotaryEvaporator,1,\nMagneticStirrer,,old\n烧杯,4,\n'

FIXED = "id,asset,x,y,yaw_deg,width\nsink,SinkBench,0.4,4.0,-90,\n,LabBench,3,0.4,0,1.4\nboard,Whiteboard,2,0.02,0,\n"


def targets() -> Iterator[Target]:
    """Yield a target for each format."""
    yield Target("dxf own", partial(_dxf, False), partial(_read_floor, "a.dxf"), ("ezdxf",), share=0.5)
    yield Target("dxf foreign", partial(_dxf, True), partial(_read_floor, "a.dxf"), ("ezdxf",))
    yield Target("ros map description", partial(_ros, True), partial(_read_floor, "map.yaml"), ("yaml",), share=0.5)
    yield Target("ros map image", partial(_ros, False), partial(_read_floor, "map.yaml"), ("yaml",), share=0.5)
    yield Target("ifc", lambda: _ifc, partial(_read_floor, "a.ifc"), ("ifcopenshell",), share=0.5)
    yield Target("inventory csv", lambda: _inventory, lambda folder: read_inventory(folder / "a.csv"), share=0.5)
    yield Target("fixed pieces csv", lambda: _fixed, lambda folder: read_fixed(folder / "a.csv"), share=0.5)
    yield Target("labbuilder scene", _scene, _read_scene, share=0.5)


def _read_scene(folder: Path) -> None:
    read_labbuilder(folder / "scene.json", skip_unknown=True)


def _scene() -> Callable[[Random | None], Case]:
    """Return the maker of scenes of a few benches and what stands on them, with their sizes; one file is damaged."""
    layout = load_published("val", published("val")[0])
    benches = [each for each in layout.placements if "Bench" in each.asset][:3]
    loads = [child for bench in benches for child in layout.children(bench.id)]
    with TemporaryDirectory() as place:
        scene = compile_layout(layout.replace(placements=(*benches, *loads)), Path(place) / "out", ["labbuilder"])[0]
        files = {path.name: path.read_bytes() for path in (scene, scene.with_name("asset_bboxes.json"))}

    def make(rng: Random | None) -> Case:
        if rng is None:
            return files
        name = rng.choice(sorted(files))
        return {**files, name: mutated_file(rng, files[name].decode())}

    return make


def _read_floor(name: str, folder: Path) -> None:
    read_floor(folder / name)


def _dxf(foreign: bool) -> Callable[[Random | None], Case]:
    text = _foreign_drawing() if foreign else _files("dxf", "a.dxf")["a.dxf"].decode()

    def make(rng: Random | None) -> Case:
        return {"a.dxf": text.encode() if rng is None else mutated_file(rng, text)}

    return make


def _ros(description: bool) -> Callable[[Random | None], Case]:
    files = _files("ros", "")
    text = files["map.yaml"].decode()

    def make(rng: Random | None) -> Case:
        if rng is None:
            return files
        if description:
            return {**files, "map.yaml": mutated_file(rng, text)}
        return {**files, "map.png": mutated_bytes(rng, files["map.png"])}

    return make


def _ifc(rng: Random | None) -> Case:
    text = _files("ifc", "a.ifc")["a.ifc"].decode()
    return {"a.ifc": text.encode() if rng is None else mutated_file(rng, text)}


def _inventory(rng: Random | None) -> Case:
    return {"a.csv": TABLE.encode() if rng is None else mutated_file(rng, TABLE)}


def _files(form: str, name: str) -> dict[str, bytes]:
    """Return the files of an empty published room in a format, by name."""
    layout = load_published("val", published("val")[0]).replace(placements=())
    with TemporaryDirectory() as place:
        folder = compile_layout(layout, Path(place) / "out" / name, [form])[0].parent
        return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def _foreign_drawing() -> str:
    """Return a small drawing in millimeters: double lines, wide polylines, nested door blocks, outlines, columns."""
    import ezdxf

    drawing = ezdxf.new("R2000", units=4)
    model = drawing.modelspace()
    for x, far in ((0, -200), (6000, 6200)):
        model.add_line((x, 0), (x, 4000), {"layer": "WALLS"})
        model.add_line((far, -200), (far, 4200), {"layer": "WALLS"})
    for y, far in ((0, -200), (4000, 4200)):
        for start, end in ((0, 2000), (3000, 6000)):
            model.add_line((start, y), (end, y), {"layer": "WALLS"})
            model.add_line((start, far), (end, far), {"layer": "WALLS"})
    room, column = ((0, 0), (6000, 0), (6000, 4000), (0, 4000)), ((900, 900), (1200, 900), (1200, 1200), (900, 1200))
    model.add_polyline2d(room, close=True, dxfattribs={"layer": "ROOM"})
    model.add_polyline2d(column, close=True, dxfattribs={"layer": "COLUMN"})
    leaf = drawing.blocks.new("LEAF")
    leaf.add_arc((0, 0), 1, 90, 180)
    door = drawing.blocks.new("DOOR")
    door.add_blockref("LEAF", (0, 0), {"xscale": 1000, "yscale": 1000})
    for y, turn in ((0, 1), (4000, -1)):
        model.add_blockref("DOOR", (3000, y), {"layer": "DOORS", "yscale": turn})
    stream = io.StringIO()
    drawing.write(stream)
    return stream.getvalue()


def _fixed(rng: Random | None) -> Case:
    return {"a.csv": FIXED.encode() if rng is None else mutated_file(rng, FIXED)}
