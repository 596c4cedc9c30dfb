"""The commands for engineers: compile, view and move."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg

from labgym.cli.arguments import (
    LayoutName,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    PolicyOptions,
    numbers,
)
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.episodes import task_and_level, view_episode, watch_episode
from labgym.cli.outcome import DONE, written
from labgym.cli.saving import Overwrite, layout_path, refuse_other_content, save
from labgym.cli.viewing import watch
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.layouts import Layout
    from labgym.layouts.rules import Assessment, Violation
    from labgym.layouts.rules.rule import FacilityIssue
    from labgym.table import Table

FormatName = Literal["mjcf", "usd", "glb", "dxf", "pdf", "svg", "bom", "services", "ifc", "ros", "labbuilder"]
MAX_LISTED = 20
"""Largest number of new violations that are listed."""


@refuses_idle_flags("compile")
def compile_(
    layout: LayoutName,
    out: Path,
    format: UseAppendAction[Annotated[tuple[FormatName, ...], arg(metavar="FORMAT")]] = (),  # noqa: A002
    interactive: bool = False,
    loose: bool = False,
    overwrite: Overwrite = False,
) -> int:
    """Compile a layout into a 3D scene, a drawing, a building model, a table or files for a robot.

    The formats are mjcf (MuJoCo, the default), usd (OpenUSD with physics, extra usd), glb (glTF for viewers), dxf
    (drawing for CAD programs, extra cad), pdf and svg (dimensioned plan at scale), ifc (building
    model IFC4, extra bim), bom (bill of materials, CSV), services (schedule of power, water, gas and exhaust, CSV), ros
    (map, masks, waypoints and URDF for Nav2), and labbuilder (scene, sizes and goal pairs in LabBuilder's form).

    Args:
        layout: A layout's .json file, or the id of a published layout.
        out: Folder for mjcf, usd, ros and labbuilder, the file for other formats. For several formats a folder, which
            receives a subfolder or a file of each.
        format: Output format; repeat --format for several.
        interactive: Drawers, doors and sashes move on joints; stools, trolleys and boxes are free bodies.
        loose: With --interactive, objects on benches and shelves are free bodies too.
        overwrite: Replace files that exist with other content, such as an edited drawing.
    """
    from labgym.envs.tasks import resolve_layout
    from labgym.exchange.formats import compile_layout

    for path in compile_layout(resolve_layout(layout), out, format or ("mjcf",), interactive, loose, overwrite):
        written(path)
    return DONE


@refuses_idle_flags("view")
def view(
    layouts: Positional[Annotated[tuple[str, ...], arg(metavar="LAYOUT [...]", help_behavior_hint="")]] = (),
    *,
    out: OptionalPath = None,
    camera: str = "topdown",
    width: OptionalWholeNumber = None,
    height: OptionalWholeNumber = None,
    protocol: OptionalText = None,
    task: OptionalText = None,
    level: int = 2,
    episode: OptionalText = None,
    web: bool = False,
    suite: Annotated[str | None, arg(aliases=("--split",), metavar="STR", help_behavior_hint="")] = None,
    policy: str = "astar",
    pair: int = 0,
    seed: int = 0,
    options: PolicyOptions = (),
    port: int = 8000,
) -> int:
    """Draw a layout or the world of a LabNav episode, or watch a policy in the browser (--web).

    The plan of a layout outlines the objects of each violation, and of each facility rule that is broken, in red with
    its number. The picture of an episode (--task) has the plan with the route, people, glass and what differs from the
    map, and a rendered view.

    Args:
        layouts: A layout's .json file, or the id of a published layout; with --web several, or folders of them.
        out: The picture: .png, by default layout.png or TASK-LEVEL.png; for topdown also .svg or .pdf, for --task .jpg.
        camera: topdown for a plan with goal poses and violations, or a camera of the scene, such as overview.
        width: Width of a rendered view in pixels; by default 1280, with --task 900.
        height: Height of a rendered view in pixels; by default 720, with --task 560.
        protocol: Id or .json file of the protocol whose goal poses are drawn; by default the layout's.
        task: Task of LabNav: aisle, moved, people, odometry, dock, glass, carry or shift, or with its level people-2.
            The episode is drawn on a floor of floors-val by --seed.
        level: Level of the task, 1 to 3, if --task does not name it.
        episode: With --task, a published episode in place of a drawn one, such as floors-val-0003/1.
        web: Serve the laboratories on 127.0.0.1 with a robot that drives their goal pairs, or the episode of --task,
            and its sensors, until Ctrl-C; nothing is written. The arguments below are for --web.
        suite: Name of a suite (lab30, val, navdp_compat), or its .json file, whose episodes the robot drives.
        policy: Policy: a name, module:Class, a file or a URL (see labgym eval --help).
        pair: Index of the first goal pair, in the first layout.
        seed: Random seed of the policy, and of an episode that is drawn.
        options: Arguments of the policy, for example deterministic=false.
        port: Port of the page; 0 takes a free port.
    """
    from labgym.envs.tasks import resolve_layout
    from labgym.eval.drawing import pictures
    from labgym.layouts.rules import evaluate_layout

    if task is not None:
        task, level = task_and_level(task, level)
        if web:
            return watch_episode(task, level, episode, seed, policy, options, port)
        return view_episode(task, level, episode, seed, out, (width, height))
    if web:
        return watch(
            layouts,
            suite=suite,
            protocol=protocol,
            policy=policy,
            pair=pair,
            seed=seed,
            options=options,
            port=port,
        )
    if len(layouts) != 1:
        raise OptionError(f"{len(layouts)} layouts to draw, expected one; --web shows several")
    scene = resolve_layout(layouts[0], protocol)
    out = Path("layout.png") if out is None else out
    if camera != "topdown":
        size = 1280 if width is None else width, 720 if height is None else height
        return written(pictures.save_view(scene, out, camera, *size))
    assessment = evaluate_layout(scene, scene.protocol, navigation=True)
    faults = _faults(assessment)
    return written(pictures.save_picture(pictures.topdown(scene, scene.protocol, violations=faults), out))


def move(
    layout: LayoutName,
    id: Positional[Annotated[str, arg(metavar="ID")]],  # noqa: A002
    out: Path,
    to: OptionalText = None,
    by: OptionalText = None,
    overwrite: Overwrite = False,
) -> int:
    """Move an object of a layout with everything on it, and print the violations before and after.

    An object on a surface must end on a surface, a wall-mounted one at a wall. Violations are printed, not prevented.

    Args:
        layout: A layout's .json file, or the id of a published layout.
        id: Id of the object, as in the layout file and on plans.
        out: The .json file of the new layout.
        to: New center x,y or x,y,yaw in meters and radians, for example 2.5,1,3.14.
        by: Shift dx,dy or dx,dy,dyaw in meters and radians, for example -0.3,0.
        overwrite: Replace OUT if it exists with other content.
    """
    from labgym.envs.tasks import resolve_layout
    from labgym.layouts.reposition import reposition
    from labgym.layouts.rules import evaluate_layout

    out = layout_path(out)
    before = resolve_layout(layout)
    after = reposition(before, id, *_place(before, id, to, by))
    refuse_other_content(after, out, overwrite)
    first = evaluate_layout(before, before.protocol, navigation=True)
    second = evaluate_layout(after, after.protocol, navigation=True, earlier=first)
    print(_comparison(id, after, first, second).text(), end="\n\n")
    return save(after, out, overwrite)


def _place(layout: Layout, placement_id: str, to: str | None, by: str | None) -> tuple[float, float, float]:
    """Return the place (x, y, yaw) that --to or --by names."""
    if (to is None) == (by is None):
        raise OptionError("name the new place with either --to X,Y[,YAW] or --by DX,DY[,DYAW]")
    placement = layout.placement(placement_id)
    x, y, yaw = *placement.position[:2], placement.yaw
    values = numbers("to", to) or numbers("by", by) or ()
    if len(values) not in (2, 3):
        raise OptionError(f"--{'by' if to is None else 'to'} takes 2 or 3 numbers, got {len(values)}")
    if to is not None:
        return values[0], values[1], values[2] if len(values) == 3 else yaw
    return x + values[0], y + values[1], yaw + (values[2] if len(values) == 3 else 0.0)


def _faults(assessment: Assessment) -> list[Violation | FacilityIssue]:
    """Return the violations and the broken facility rules of a layout."""
    return [*assessment.violations.items, *assessment.errors]


def _comparison(placement_id: str, after: Layout, first: Assessment, second: Assessment) -> Table:
    """Return the numbers of violations of each kind before and after a move, with the new ones as notes."""
    from labgym.table import Table

    counts = [
        Counter([item.kind for item in each.violations.items] + ["facility errors"] * len(each.errors))
        for each in (first, second)
    ]
    kinds = ("bounds", "collision", "flammable", "incompatible", "storage", "navigation", "facility errors")
    rows = [(kind, *(str(count[kind]) for count in counts)) for kind in kinds if any(count[kind] for count in counts)]
    rows.append(("all", *(str(sum(count.values())) for count in counts)))
    known = {fault.message for fault in _faults(first)}
    new = [fault.message for fault in _faults(second) if fault.message not in known]
    notes = [f"New: {message}" for message in new[:MAX_LISTED]]
    if len(new) > MAX_LISTED:
        notes.append(f"and {len(new) - MAX_LISTED} more: see labgym score")
    placement = after.placement(placement_id)
    x, y, z = placement.position
    title = f"{placement_id} at ({x:.3f}, {y:.3f}, {z:.3f}), yaw {placement.yaw:.4f}, on {placement.support}"
    return Table(title, ("violations", "before", "after"), tuple(rows), tuple(notes))
