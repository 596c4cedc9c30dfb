"""The commands that read laboratories of other programs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from labgym.cli.arguments import OptionalPath, OptionalText
from labgym.cli.saving import Overwrite, layout_path, save
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.layouts.floor import Door


Doors = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="WALL,OFFSET[,WIDTH]")]]
Names = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="NAME=ASSET")]]


def labbuilder(
    scene: Positional[Annotated[Path, arg(metavar="SCENE")]],
    *,
    sizes: OptionalPath = None,
    protocol: OptionalText = None,
    out: OptionalPath = None,
    door: Doors = (),
    map: Names = (),  # noqa: A002
    skip_unknown: bool = False,
    overwrite: Overwrite = False,
) -> int:
    """Read a scene of LabBuilder as a layout; print what was assumed, renamed or left out on standard error.

    Poses and sizes stay as they are in the files, so that labgym score counts their violations (docs/labbuilder.md).

    Args:
        scene: The .json file of the scene.
        sizes: File of sizes by asset. Default: asset_bboxes.json next to the scene, if there is one.
        protocol: Id or .json file of a protocol to embed; the scene has none.
        out: The .json file of the layout. Default: the scene's name in the current folder.
        door: A door, for example front,1.5 or left,2,0.9 in meters from the wall's start; repeat --door for several.
        map: Asset of the catalog for a name of the scene, for example Shelf=EquipmentRack; repeat --map for several.
        skip_unknown: Leave out objects that the catalog does not have, in place of an error.
        overwrite: Replace OUT if it exists with other content; the scene itself is never replaced.
    """
    from labgym import protocols
    from labgym.paper.labbuilder.reading import read_labbuilder

    imported = read_labbuilder(
        scene,
        sizes,
        (protocols.resolve(protocol),) if protocol is not None else (),
        tuple(_door(text) for text in door),
        dict(_pair(text) for text in map),
        skip_unknown,
    )
    target = layout_path(out if out is not None else Path(f"{imported.layout.id}.json"))
    if target.exists() and target.samefile(scene):
        raise OptionError(f"{target} is the scene itself: name another file with --out")
    for note in imported.notes:
        print(f"note: {note}", file=sys.stderr)
    return save(imported.layout, target, overwrite)


def _door(text: str) -> Door:
    from labgym.layouts.floor import Door

    wall, *numbers = text.split(",")
    try:
        values = [float(number) for number in numbers]
        if len(values) not in (1, 2):
            raise ValueError
        return Door(wall=wall, offset=values[0], **({"width": values[1]} if len(values) == 2 else {}))
    except ValueError:
        raise OptionError(
            f"--door {text[:60]!r} must be front, back, left or right, and its middle and width in meters: front,1.5,1"
        ) from None


def _pair(text: str) -> tuple[str, str]:
    name, equals, asset = text.partition("=")
    if not (name and equals and asset):
        raise OptionError(f"--map {text[:80]!r} is not NAME=ASSET, such as Shelf=EquipmentRack")
    return name, asset
