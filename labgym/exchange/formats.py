"""Formats that layouts are compiled to, and files that floors are read from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from tempfile import TemporaryDirectory

from labgym.documents import folder_path
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.layouts.floor import Floor


@dataclass(frozen=True)
class Format:
    """A format that layouts are compiled to.

    Attributes:
        suffix: of the file; empty for a folder.
        write: writes a layout to a path and returns the main file.
        write_interactive: writes it with moving parts, and with loose objects or not; None if the format has none.
    """

    suffix: str
    write: Callable[[Layout, Path], Path]
    write_interactive: Callable[[Layout, Path, bool], Path] | None = None


def formats() -> Mapping[str, Format]:
    """Return the formats by name."""
    return {
        "mjcf": Format("", _mjcf, _interactive_mjcf),
        "usd": Format("", _usd, _interactive_usd),
        "glb": Format(".glb", _glb),
        "dxf": Format(".dxf", _dxf),
        "pdf": Format(".pdf", _plan),
        "svg": Format(".svg", _plan),
        "bom": Format(".csv", _bill),
        "services": Format(".services.csv", _schedule),
        "ifc": Format(".ifc", _ifc),
        "ros": Format("", _ros),
        "labbuilder": Format("", _labbuilder),
    }


def compile_layout(
    layout: Layout,
    out: Path,
    names: Sequence[str],
    interactive: bool = False,
    loose: bool = False,
    overwrite: bool = True,
) -> list[Path]:
    """Write a layout in one or more formats and return the main file of each.

    Args:
        out: for one format its file or folder; for several a folder, which gets a subfolder or a file for each.
        interactive, loose: what moves in 3D scenes, see `labgym.scenes.to_mjcf`.
        overwrite: whether to replace files that exist with other content.

    Raises:
        OptionError: a format occurs twice, the path does not suit it, the format has no moving parts, or a file exists
            with other content and is not to be replaced; then no file is written.
        LabgymError: a folder exists and holds other files.
    """
    table = formats()
    if len(set(names)) != len(names):
        raise OptionError(f"formats {', '.join(names)}: each may be named once")
    if loose and not interactive:
        raise OptionError("--loose is for interactive scenes: add --interactive")
    writers: list[Callable[[Layout, Path], Path]] = [table[name].write for name in names]
    if interactive:
        writers = [partial(_write_interactive, _interactive_writer(name, table), loose) for name in names]
    if len(names) > 1:
        folder_path(out)
    paths = (
        [out] if len(names) == 1 else [out / (f"{layout.id}{table[n].suffix}" if table[n].suffix else n) for n in names]
    )
    if not overwrite:
        for write, path in zip(writers, paths, strict=True):
            _refuse_other_content(layout, write, path)
    return [write(layout, path) for write, path in zip(writers, paths, strict=True)]


def _refuse_other_content(layout: Layout, write: Callable[[Layout, Path], Path], path: Path) -> None:
    """Raise an error if a file that would be written, or a file in a folder, exists with other content."""
    if not path.exists():
        return
    with TemporaryDirectory() as place:
        fresh = Path(place) / path.name
        write(layout, fresh)
        # Other entries of a folder are never replaced: write_mjcf and its like refuse them.
        entries = [path / entry.name for entry in sorted(fresh.iterdir())] if fresh.is_dir() else [path]
        for old in (each for entry in entries for each in (entry, *sorted(entry.rglob("*")))):
            new = fresh / old.relative_to(path)
            if old.is_file() and not (new.is_file() and new.read_bytes() == old.read_bytes()):
                raise OptionError(f"{old} exists with other content: name another path, or replace it with --overwrite")


def _write_interactive(write: Callable[[Layout, Path, bool], Path], loose: bool, layout: Layout, path: Path) -> Path:
    return write(layout, path, loose)


def _interactive_writer(name: str, table: Mapping[str, Format]) -> Callable[[Layout, Path, bool], Path]:
    writer = table[name].write_interactive
    if writer is None:
        able = " and ".join(other for other, each in table.items() if each.write_interactive is not None)
        raise OptionError(f"--interactive is for {able}; format {name} has no moving parts")
    return writer


def read_floor(
    path: str | Path,
    unit: str | None = None,
    thickness: float | None = None,
    crop: Sequence[float] | None = None,
    storey: str | None = None,
) -> Floor:
    """Read a floor from a DXF drawing, a building model (IFC) or the map.yaml of a map of ROS.

    Args:
        unit: of a drawing: in, ft, mm, cm, dm or m; by default its $INSUNITS.
        thickness: of walls that the file does not show, meters.
        crop: the part (x0, y0, x1, y1) of a drawing that is read, in its units; None for all of it.
        storey: number or name of a storey of a building model; None for the one with most spaces and walls.

    Raises:
        OptionError: the path has another suffix, or an option is out of range.
        DocumentError: the file is missing, too large or damaged, or describes no floor.
        MissingDependencyError: the extra `cad` or `bim` is not installed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if storey is not None and suffix != ".ifc":
        raise OptionError("--storey is for building models (.ifc)")
    if suffix == ".ifc":
        from labgym.exchange.ifc.reading import read_ifc

        if unit is not None or crop is not None or thickness is not None:
            raise OptionError("--unit, --crop and --thickness are for drawings; a building model has its own")
        return read_ifc(path, storey)
    if suffix == ".dxf":
        from labgym.exchange.dxf.reading import WALL_THICKNESS, read_dxf
        from labgym.exchange.dxf.sheets import Window

        window = None if crop is None else Window.parse(crop)
        return read_dxf(path, unit, WALL_THICKNESS if thickness is None else thickness, window)
    if suffix in (".yaml", ".yml"):
        from labgym.exchange.ros_outline import read_ros_map

        if unit is not None or crop is not None:
            raise OptionError("--unit and --crop are for drawings; a map of ROS is in meters")
        return read_ros_map(path, thickness)
    if suffix == ".dwg":
        raise OptionError(f"{path.name!r} is in a format that only its own programs read: save it as DXF")
    raise OptionError(f"floor {path.name!r} must end in .dxf, .ifc, or .yaml for a map of ROS")


def empty_layout(floor: Floor) -> Layout:
    """Return a layout of a floor without objects and protocols; its id is the floor's name."""
    return Layout(id=floor.label, floor=floor, placements=())


def _mjcf(layout: Layout, out: Path) -> Path:
    from labgym import scenes

    return scenes.write_mjcf(layout, out)


def _interactive_mjcf(layout: Layout, out: Path, loose: bool) -> Path:
    from labgym import scenes

    return scenes.write_mjcf(layout, out, interactive=True, loose=loose)


def _usd(layout: Layout, out: Path) -> Path:
    from labgym import scenes

    return scenes.write_usd(layout, out)


def _interactive_usd(layout: Layout, out: Path, loose: bool) -> Path:
    from labgym import scenes

    if loose:
        raise OptionError("--loose is for mjcf; in usd, instruments and glassware on surfaces are free bodies anyway")
    return scenes.write_usd(layout, out, interactive=True)


def _glb(layout: Layout, out: Path) -> Path:
    from labgym import scenes

    return scenes.write_glb(layout, out)


def _dxf(layout: Layout, out: Path) -> Path:
    from labgym.exchange.dxf.writing import write_dxf

    return write_dxf(layout, out)


def _plan(layout: Layout, out: Path) -> Path:
    from labgym.exchange.plan import write_plan

    return write_plan(layout, out)


def _bill(layout: Layout, out: Path) -> Path:
    from labgym.exchange.bill import write_bill

    return write_bill(layout, out)


def _schedule(layout: Layout, out: Path) -> Path:
    from labgym.exchange.schedule import write_schedule

    return write_schedule(layout, out)


def _ifc(layout: Layout, out: Path) -> Path:
    from labgym.exchange.ifc.writing import write_ifc

    return write_ifc(layout, out)


def _ros(layout: Layout, out: Path) -> Path:
    from labgym.exchange.ros_map import write_ros_map

    return write_ros_map(layout, out)


def _labbuilder(layout: Layout, out: Path) -> Path:
    # By name: the house knows nothing of the paper's room.
    write: Callable[[Layout, Path], Path] = resolve_name("labgym.paper.labbuilder.writing:write_labbuilder")
    return write(layout, out)
