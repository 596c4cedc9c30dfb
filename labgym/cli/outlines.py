"""The command outline: the floor of a drawing or a map, read strictly or recognized."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import ValidationError
from tyro.conf import Positional, UseAppendAction, arg

from labgym.cli.arguments import OptionalNumber, OptionalPath, OptionalText, numbers
from labgym.cli.saving import Overwrite, layout_path, refuse_other_content, save, save_bytes
from labgym.errors import DocumentError, OptionError

if TYPE_CHECKING:
    from labgym.exchange.recognition.proposal import Answers, Proposal
    from labgym.layouts.floor import Floor

Points = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="X,Y")]]
Lines = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="X0,Y0,X1,Y1")]]
Corners = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="X0,Y0,X1,Y1,X2,Y2")]]
Numbers = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="N,M")]]


def outline(
    file: Positional[Annotated[Path, arg(metavar="FILE")]],
    *,
    out: Path,
    unit: OptionalText = None,
    thickness: Annotated[float | None, arg(metavar="METERS", help_behavior_hint="")] = None,
    crop: OptionalText = None,
    storey: OptionalText = None,
    scale: OptionalNumber = None,
    area: OptionalNumber = None,
    layers: OptionalText = None,
    door: Points = (),
    split: Lines = (),
    merge: Numbers = (),
    furniture: Lines = (),
    outline: Corners = (),
    answers: OptionalPath = None,
    overwrite: Overwrite = False,
) -> int:
    """Read the floor of a drawing, a building model, a ROS map or an image, and write it as a layout without objects.

    A file that cannot be read exactly is recognized: the command proposes a floor, lists what it left out and what it
    is not certain of, and writes a picture of what it recognized (OUT with the suffix .png) and the answers so far
    (.answers.json). The options from --scale on answer its questions. docs/engineers.md says what is read.

    Args:
        file: A .dxf drawing, an .ifc building model, the map.yaml of a ROS map next to its image, or the .png or
            .pdf of a floor plan (with --scale or --area).
        out: The .json file of the layout.
        unit: Unit of the drawing, in place of the one that it names: in, ft, mm, cm, dm or m.
        thickness: Thickness of walls that the file does not show, meters. Default: 0.2 for a drawing without walls; of
            a map what it shows.
        crop: X0,Y0,X1,Y1: the part of a drawing that is read, in its units, such as a plan next to an elevation.
        storey: Storey of a building model: its number from the lowest, from 1, or its name. Default: the one with most
            spaces and walls.
        scale: Meters per unit of a drawing, per pixel of an image or per point of a PDF file (0.0353 for 1:100), or a
            factor on the resolution of a map.
        area: Area of all rooms in square meters, from which the scale follows.
        layers: Layers of a drawing with its walls, with commas between them.
        door: Place of a door, meters; repeat --door for several. Write --door=X,Y for negative numbers.
        split: A wall that divides a room, meters; repeat --split for several.
        merge: Numbers of rooms in the picture that are one room, with 0 those that are no rooms; repeat --merge for
            several.
        furniture: Two corners of an area that is furniture and no wall, meters; repeat --furniture for several.
        outline: A room by its corners in order, three or more, meters, in place of what was recognized there; repeat
            --outline for several.
        answers: Answers that an earlier run wrote, in place of the eight options above.
        overwrite: Replace OUT, its picture and its answers if they exist with other content.
    """
    from labgym.exchange.formats import empty_layout, read_floor
    from labgym.exchange.recognition.proposal import IMAGES

    out = layout_path(out)
    given = _answers((unit, storey), (scale, area, layers), (door, split, merge, furniture, outline), answers)
    if out.with_suffix(".png").resolve() == file.resolve():
        raise OptionError(f"the picture of the proposal would replace {file.name}: name another --out")
    plain = _plain(unit, storey)
    proposal: Proposal | None = None
    floor: Floor
    try:
        if not file.exists():
            raise DocumentError(file, "", "no such file")
        if given is not None or file.suffix.lower() in IMAGES:
            raise DocumentError(file, "", "an image of a plan" if given is None else "answers are for recognition")
        floor = read_floor(file, unit, thickness, numbers("crop", crop), storey)
    except DocumentError as error:
        if thickness is not None or crop is not None or not file.is_file():
            raise
        proposal = _recognized(file, given or plain, "" if given is not None else str(error))
        floor = proposal.floor
    layout = empty_layout(floor)
    for space in layout.floor.spaces:
        print(f"{space.id}: {space.use}, {space.area:.1f} m²", file=sys.stderr)
    if proposal is not None:
        _save_proposal(proposal, given or plain, out, overwrite)
    return save(layout, out, overwrite)


def _answers(
    stated: tuple[str | None, str | None],
    values: tuple[float | None, float | None, str | None],
    places: tuple[Sequence[str], ...],
    file: Path | None,
) -> Answers | None:
    """Return the answers of the command line or of a file, None without any."""
    from labgym.exchange.recognition.proposal import Answers

    (scale, area, layers), (door, split, merge, furniture, outline), (unit, storey) = values, places, stated
    if file is not None:
        if any(value is not None for value in values) or any(places):
            raise OptionError(
                "--answers replaces --scale, --area, --layers, --door, --split, --merge, --furniture and --outline: "
                "give one form"
            )
        return Answers.load(file)
    if not (any(value is not None for value in values) or any(places)):
        return None
    if scale is not None and (area is not None or unit is not None):
        raise OptionError("--scale, --area and --unit exclude each other")
    try:
        return Answers(
            scale=_plain(unit, None).scale if scale is None else scale,
            storey=storey,
            area=area,
            layers=tuple(part.strip() for part in layers.split(",")) if layers else (),
            doors=tuple(numbers("door", text) for text in door),
            splits=tuple(numbers("split", text) for text in split),
            merges=tuple(tuple(int(number) for number in numbers("merge", text) or ()) for text in merge),
            furniture=tuple(numbers("furniture", text) for text in furniture),
            outlines=tuple(_corners(text) for text in outline),
        )
    except ValidationError as error:
        place, problem = error.errors()[0]["loc"], error.errors()[0]["msg"]
        raise OptionError(f"--{str(place[0]).rstrip('s')}: {problem}") from None


def _corners(text: str) -> tuple[tuple[float, ...], ...]:
    """Return the points of a list of coordinates."""
    values = numbers("outline", text) or ()
    if len(values) % 2:
        raise OptionError(f"--outline: {len(values)} numbers; each corner has an x and a y")
    return tuple(zip(values[::2], values[1::2], strict=True))


def _plain(unit: str | None, storey: str | None) -> Answers:
    """Return the answers of --unit and --storey alone."""
    from labgym.exchange.dxf.opening import UNITS
    from labgym.exchange.recognition.proposal import Answers

    if unit is not None and unit not in UNITS:
        raise OptionError(f"unit {unit[:20]!r} must be one of {', '.join(UNITS)}")
    return Answers(scale=None if unit is None else UNITS[unit], storey=storey)


def _recognized(file: Path, answers: Answers, refusal: str) -> Proposal:
    """Return the proposal for a file, and print why it is one, what was left out, and its questions."""
    from labgym.exchange.recognition.proposal import recognize

    proposal = recognize(file, answers)
    if refusal:
        print(f"recognized, because it cannot be read exactly: {refusal}", file=sys.stderr)
    for part in proposal.skipped:
        print(f"left out: {part}", file=sys.stderr)
    for question in proposal.questions:
        print(f"question: {question}", file=sys.stderr)
    return proposal


def _save_proposal(proposal: Proposal, answers: Answers, out: Path, overwrite: bool) -> None:
    """Write the picture and the answers next to the layout; other content is replaced only with `overwrite`."""
    from labgym.exchange.recognition.overlay import overlay_png

    picture, answered = out.with_suffix(".png"), out.with_suffix(".answers.json")
    refuse_other_content(answers, answered, overwrite)
    save_bytes(overlay_png(proposal), picture, overwrite)
    save(answers, answered, overwrite)
