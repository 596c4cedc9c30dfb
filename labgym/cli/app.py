"""From a chemistry protocol to a laboratory that a robot can work in, and a benchmark over it.

`labgym run` does everything; each other command is one stage of it. Exit codes: 0 done, 1 a check or a policy failed,
2 bad input.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg
from tyro.extras import SubcommandApp

from labgym import protocols as library
from labgym.cli.assets import assets_app
from labgym.cli.outcome import BAD_INPUT, DONE, FAILED, INTERRUPTED, complaints, findings, written
from labgym.cli.protocols import protocols_app
from labgym.cli.training import ablate_app, card_app, data, train_app
from labgym.errors import LabgymError, OptionError
from labgym.pipeline import RunConfig
from labgym.protocols import Protocol

Layout_ = Positional[Annotated[str, arg(metavar="LAYOUT")]]
Protocol_ = Positional[Annotated[str, arg(metavar="PROTOCOL")]]

app = SubcommandApp()

GROUPS = {"assets": assets_app, "protocols": protocols_app}
"""Commands that do something without the name of a further command."""


@app.command
def run(config: OmitArgPrefixes[RunConfig]) -> int:
    """Take the 30 protocols to layouts, scenes, episodes, two tables, pictures and a report."""
    from labgym.pipeline.run import run_pipeline

    _find_own_modules()
    outcome = run_pipeline(config)
    for table in outcome.tables:
        print(f"\n{table.text()}\n")
    for reason in outcome.left_out:
        print(f"Left out: {reason}")
    print("Written:", *outcome.written, sep="\n  ")
    return complaints(outcome.problems)


app.command(assets_app, name="assets", help="List the assets, show one, check the catalogue, add meshes, write USD.")
app.command(protocols_app, name="protocols", help="List the protocols, show or validate one.")


@app.command
def generate(
    protocol: Protocol_, seed: int = 0, room: str | None = None, profile: str = "default", out: Path = Path()
) -> int:
    """Generate a laboratory for a protocol.

    Args:
        protocol: Id of a protocol, or a protocol's .json file.
        seed: The same seed gives the same layout on any machine.
        room: A room preset: tight, default, roomy or two_exits.
        profile: Thresholds to satisfy: default, strict or paper.
        out: A .json file, or a folder for a file named after protocol and seed.
    """
    from labgym.layouts import generate as make

    layout = make(_protocol(protocol), seed=seed, room=room, profile=profile)
    return written(layout.save(out if out.suffix == ".json" else out / f"{layout.id}.json"))


@app.command
def score(
    layout: Layout_,
    protocol: str | None = None,
    profile: str = "default",
    as_json: Annotated[bool, arg(name="json")] = False,
    check: bool = False,
) -> int:
    """Score a layout: geometry, feasibility, chemical safety.

    Args:
        layout: A layout's .json file, or the id of a published one.
        protocol: Id or .json file of the protocol to score it for; by default the one that the layout names.
        profile: Thresholds: default, strict or paper.
        as_json: Print the whole report as JSON.
        check: Exit 1 where the layout has a violation or lacks an asset.
    """
    from labgym.cli.describe import layout_score
    from labgym.envs.tasks import resolve_layout
    from labgym.eval import score as evaluate

    report = evaluate(resolve_layout(layout), _protocol(protocol) if protocol else None, profile)
    print(json.dumps(report.to_json(), indent=1, ensure_ascii=False) if as_json else layout_score(report))
    return FAILED if check and (report.violations or report.missing) else DONE


@app.command(name="compile")
def compile_(layout: Layout_, out: Path, format: Literal["mjcf", "glb", "usd"] = "mjcf") -> int:  # noqa: A002
    """Compile a layout into a scene that stands on its own.

    Args:
        layout: A layout's .json file, or the id of a published one.
        out: Folder for scene.xml and its meshes, or scene.usda and its assets; for glb the file.
        format: MuJoCo's MJCF, OpenUSD with physics (extra usd), or GLB for viewers of 3D models.
    """
    from labgym import scenes
    from labgym.envs.tasks import resolve_layout

    write = {"mjcf": scenes.write_mjcf, "glb": scenes.write_glb, "usd": scenes.write_usd}[format]
    return written(write(resolve_layout(layout), out))


@app.command
def view(
    layout: Layout_, out: Path = Path("layout.png"), camera: str = "topdown", width: int = 1280, height: int = 720
) -> int:
    """Draw a layout from above, or render a view of it.

    Args:
        layout: A layout's .json file, or the id of a published one.
        out: The picture, a .png (or .svg for topdown).
        camera: topdown for a plan with goal poses, or a camera of the scene, such as overview.
        width: Width of a rendered view in pixels.
        height: Height of a rendered view in pixels.
    """
    from labgym.envs.tasks import resolve_layout
    from labgym.eval.drawing import pictures

    given = resolve_layout(layout)
    if camera == "topdown":
        protocol = _protocol(given.protocol) if given.protocol else None
        return written(pictures.save_picture(pictures.topdown(given, protocol), out))
    return written(pictures.save_view(given, out, camera, width, height))


@app.command(name="eval")
def eval_(
    policy: str = "astar",
    suite: Annotated[str, arg(aliases=("--split",))] = "test",
    layouts: tuple[str, ...] = (),
    seed: int = 0,
    workers: int = 1,
    out: Path | None = None,
    options: tuple[str, ...] = (),
) -> int:
    """Evaluate a policy: drive every goal pair of every layout once.

    Args:
        policy: A name such as astar, module:Class of your own, an .onnx, .pt or .zip file, or a server's http:// URL.
        suite: Name of a suite (test, val, navdp_compat), or its .json file.
        layouts: Layouts to drive in, in place of a suite: .json files or ids of published ones.
        seed: Seed of whatever is random in the policy.
        workers: Processes to use; the numbers do not depend on it.
        out: Folder for episodes, routes and summary; by default runs/POLICY-SUITE.
        options: Arguments of the policy as NAME=VALUE.
    """
    from labgym.envs.tasks import resolve_layout
    from labgym.eval.driving.runner import evaluate
    from labgym.eval.reports.tables import navigation_table
    from labgym.policies.registry import parse_options

    _find_own_modules()
    given = [resolve_layout(name) for name in layouts]
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", policy)
    folder = out or Path("runs") / f"{name}-{'layouts' if given else Path(suite).stem}"
    arguments = parse_options(options)
    summary = evaluate(policy, given or suite, workers=workers, out=folder, seed=seed, options=arguments).summary
    for layout in given:
        layout.save(folder / "layouts" / f"{layout.id}.json")
    print(f"\n{navigation_table({policy: summary.metrics}, f'suite {summary.suite.label}').text()}\n")
    written(folder)
    return complaints([f"{summary.errors} episodes failed in the policy"] if summary.errors else [])


@app.command
def record(
    layout: Layout_,
    policy: str = "astar",
    pair: int = 0,
    out: Path = Path("drive.mp4"),
    seed: int = 0,
    width: int = 640,
    height: int = 480,
    options: tuple[str, ...] = (),
) -> int:
    """Film a policy that drives one goal pair of a layout.

    Args:
        layout: A layout's .json file, or the id of a published one.
        policy: What eval takes.
        pair: Index of the goal pair, in the order of the protocol's steps.
        out: The film, .mp4 or .gif.
        seed: Seed of whatever is random in the policy.
        width: Width in pixels.
        height: Height in pixels.
        options: Arguments of the policy as NAME=VALUE.
    """
    from tqdm import tqdm

    from labgym.envs.tasks import resolve_layout
    from labgym.eval.drawing.film import check_film_path, film, save_film
    from labgym.eval.driving.drive import drive_pairs
    from labgym.eval.driving.suites import suite_of
    from labgym.navigation import goal_pairs
    from labgym.policies import make_policy
    from labgym.policies.registry import parse_options

    _find_own_modules()
    check_film_path(out)
    given = resolve_layout(layout)
    pairs = goal_pairs(given)
    if not 0 <= pair < len(pairs):
        raise OptionError(f"pair {pair}: layout {given.id!r} has the goal pairs 0 to {len(pairs) - 1}")
    driver = make_policy(policy, **parse_options(options))
    try:
        (drive,) = drive_pairs(driver, given, pairs[pair : pair + 1], suite_of([given]), policy, seed)
    finally:
        driver.close()
    row = drive.row
    print(f"{'arrived' if row.success else 'not in time'} after {row.time:.1f} s, {row.path_length:.2f} m driven")
    written(save_film(tqdm(film(given, drive.route, width, height), "film", len(drive.route)), out))
    return complaints([row.error] if row.error else [])


@app.command
def serve(
    policy: Positional[str], host: str = "127.0.0.1", port: int = 8888, seed: int = 0, options: tuple[str, ...] = ()
) -> int:
    """Serve a policy over HTTP by the NavDP benchmark's protocol, until Ctrl-C.

    Args:
        policy: What eval takes; not one that needs the map.
        host: Address to listen at; whoever reaches it can use the policy.
        port: Port to listen at; 0 takes a free one.
        seed: Seed of whatever is random in the policy.
        options: Arguments of the policy as NAME=VALUE.
    """
    from labgym.policies import make_policy
    from labgym.policies.http.server import NavigationServer
    from labgym.policies.registry import parse_options

    _find_own_modules()
    arguments = parse_options(options)
    with NavigationServer(lambda: make_policy(policy, **arguments), host, port, seed) as server:
        print(f"Serving {policy} at {server.url}; Ctrl-C ends it", flush=True)
        with suppress(KeyboardInterrupt):
            server.serve_forever()
    return DONE


@app.command
def reproduce(split: Literal["val", "test"] = "test", out: Path | None = None) -> int:
    """Make the published layouts again from their seeds and compare hashes; exit 1 where one differs.

    Args:
        split: Which of the published splits.
        out: Also write the layouts and their manifest there, as SPLIT/; into layouts/ of a checkout to publish anew.
    """
    from tqdm import tqdm

    from labgym.layouts.splits import make_published, manifest, publish

    entries = manifest(split).layouts
    layouts = [make_published(split, index) for index in tqdm(range(len(entries)), desc=split)]
    if out is not None:
        publish(split, layouts, out)
        written(out / split)
    pairs = zip(entries, layouts, strict=True)
    differing = [f"{entry.id} is made otherwise" for entry, layout in pairs if layout.hash != entry.hash]
    return complaints(differing) or findings(())


app.command(data)
app.command(train_app, name="train", help="Train a policy; each command goes on where it was stopped.")
app.command(ablate_app, name="ablate", help="Leave out parts of a trained policy; train and drive the rest.")
app.command(card_app, name="card", help="Publish a trained policy with a card.")


@app.command
def report(folder: Positional[Path], workers: int = 1) -> int:
    """Draw the routes and write tables and report.html for a folder that run or eval wrote.

    Args:
        folder: The folder, for example runs/default.
        workers: Processes to draw with.
    """
    from labgym.pipeline.run import report_folder

    tables, written = report_folder(folder, workers)
    for table in tables:
        print(f"\n{table.text()}\n")
    print("Written:", *written, sep="\n  ")
    return DONE


@app.command
def bench(rounds: int = 15) -> int:
    """Time the pieces, each as a ratio to something that does the same work.

    Args:
        rounds: How often each is timed.
    """
    from tqdm import tqdm

    from labgym.bench import bench as timings
    from labgym.bench import bench_table

    if rounds < 2:
        raise OptionError(f"rounds is {rounds}, expected at least 2")
    print(bench_table(list(tqdm(timings(rounds), "bench"))).text())
    return DONE


@app.command
def doctor() -> int:
    """Say what this machine has: versions, cores, renderer, display; what is missing, and how to get it."""
    from labgym.doctor import examine, healthy
    from labgym.doctor import report as findings_table

    found = examine()
    print(findings_table(found))
    return DONE if healthy(found) else FAILED


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; an error is one line on standard error."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that knows fewer characters than a name has still shows the rest.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    if given and given[0] in GROUPS:
        given[1:] = GROUPS[given[0]].named(given[1:])
    try:
        return int(app.cli(prog="labgym", description=__doc__, args=given or ["--help"]))
    except LabgymError as error:
        return _fail(str(error))
    except BrokenPipeError:
        # Whoever read our output has gone; silence the flush at exit too.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except OSError as error:
        return _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except KeyboardInterrupt:
        print("labgym: interrupted; what was finished is kept", file=sys.stderr)
        return INTERRUPTED


def _find_own_modules() -> None:
    """Let `--policy module:Class` find modules in the working folder, as `python -m` would."""
    sys.path.append(str(Path.cwd()))


def _protocol(given: str) -> Protocol:
    return library.resolve(given)


def _fail(message: str) -> int:
    line = "".join(char if char.isprintable() else repr(char)[1:-1] for char in message)
    print(f"labgym: error: {line}", file=sys.stderr)
    return BAD_INPUT
