"""Generate chemistry laboratories from protocols and benchmark robot navigation in them.

`labgym run` runs the whole pipeline; each other command runs one stage of it. `labgym --version` prints the version.
Exit codes: 0 done, 1 a check or a policy failed, 2 bad input, 130 Ctrl-C, 143 SIGTERM.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import FlagCreatePairsOff, OmitArgPrefixes, Positional, arg
from tyro.extras import SubcommandApp

from labgym import __version__
from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    ExecutorArguments,
    Folders,
    LayoutName,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    PolicyOptions,
    Texts,
    allow_local_modules,
    numbers,
    parse_options,
)
from labgym.cli.assets import assets_app
from labgym.cli.engineering import compile_, move, outline, view
from labgym.cli.layouts import generate
from labgym.cli.outcome import BAD_INPUT, DONE, FAILED, SIGNALED, complaints, findings, written
from labgym.cli.protocols import protocols_app
from labgym.cli.scores import score
from labgym.cli.signals import Terminated, raise_termination
from labgym.cli.submission import submit_app
from labgym.cli.training import ablate_app, card_app, data, train_app
from labgym.errors import LabgymError, OptionError
from labgym.pipeline import RunConfig

app = SubcommandApp()

GROUPS = {"assets": assets_app, "protocols": protocols_app}
"""Groups whose default command runs when no command of the group is named."""


@app.command
def run(
    config: OmitArgPrefixes[RunConfig],
    executor: Literal["local", "dask", "slurm"] = "local",
    scheduler: OptionalText = None,
    slurm: PolicyOptions = (),
) -> int:
    """Run the whole pipeline: layouts, scenes, episodes, two tables, pictures and a report.

    Args:
        executor: Where layouts are made and policies drive: local processes, the Dask cluster of --scheduler, or Slurm
            jobs (docs/scale.md). Pictures are drawn in local processes.
        scheduler: Address of the Dask scheduler, such as tcp://127.0.0.1:8786.
        slurm: Parameters of the Slurm jobs by submitit's names, such as slurm_partition=cpu timeout_min=60.
    """
    from labgym.pipeline.run import run_pipeline

    allow_local_modules()
    execution = ExecutorArguments(config.processes, executor, scheduler, slurm)
    outcome = run_pipeline(config, execution.options())
    for table in outcome.tables:
        print(f"\n{table.text()}\n")
    for reason in outcome.left_out:
        print(f"Left out: {reason}")
    print("Written:", *outcome.paths, sep="\n  ")
    return complaints(outcome.problems)


app.command(
    assets_app,
    name="assets",
    help="List, show, find and check assets; add meshes; write USD files. Plain `labgym assets` lists all; "
    "`labgym assets rotovap` shows one (short for `show rotovap`).",
)
app.command(
    protocols_app,
    name="protocols",
    help="List, show, search, write, check and import protocols. Plain `labgym protocols` lists the published ones; "
    "`labgym protocols sub_01` shows one (short for `show sub_01`).",
)


app.command(generate)


app.command(score)


app.command(name="compile")(compile_)
app.command(view)
app.command(move)
app.command(outline)


@app.command(name="eval")
def eval_(
    policy: str = "astar",
    suite: Annotated[str, arg(aliases=("--split",))] = "test",
    layouts: Texts = (),
    protocol: OptionalText = None,
    seed: int = 0,
    out: OptionalPath = None,
    options: PolicyOptions = (),
    fresh: bool = False,
    execution: Execution = THIS_PROCESS,
    repeats: OptionalWholeNumber = None,
    jitter: bool = False,
    limits: PolicyOptions = (),
    kernels: OptionalText = None,
) -> int:
    """Evaluate a policy: drive every goal pair of every layout.

    Args:
        policy: A name such as astar (labgym policies lists them), module:Class, an .onnx, .pt or .zip file, or the
            http:// URL of a policy server.
        suite: Name of a suite (test, also called lab30; val; navdp_compat), or its .json file.
        layouts: Layouts to drive in instead of a suite: .json files, folders of them (such as labgym generate --count
            writes), or ids of published layouts.
        protocol: Id or .json file of the protocol to drive for in the layouts; by default the one they embed.
        seed: Random seed of the policy.
        out: Folder for episodes, routes and summary; by default runs/POLICY-SUITE. An interrupted evaluation resumes.
        options: Arguments of the policy, for example trust=true.
        fresh: Rename an existing folder to NAME.old-1, NAME.old-2, ... and start anew.
        repeats: Number of episodes per goal pair; by default the suite's.
        jitter: Displace the start of every episode by up to 2 cm and 2 degrees, clear of obstacles; a suite's .json
            file can set other values.
        limits: Limits of the policy's process: call_seconds=300 for one call of reset or act, load_seconds=600,
            memory_gb=8. A policy that exceeds one fails its episode.
        kernels: pinned (the default where the processor has AVX2) gives equal results on every such processor, native
            is faster.
    """
    from labgym.envs.tasks import resolve_layouts
    from labgym.eval.driving.folders import default_folder
    from labgym.eval.driving.runner import evaluate
    from labgym.eval.driving.suites import Jitter, load_suite, suite_of
    from labgym.eval.reports.tables import navigation_table
    from labgym.policies.process import ProcessLimits

    allow_local_modules()
    if policy == "?":
        from labgym.policies.registry import policy_table

        print(policy_table())
        return DONE
    if protocol is not None and not layouts:
        raise OptionError("--protocol is for --layouts; the layouts of a suite embed their protocols")
    chosen = resolve_layouts(layouts, protocol)
    rules = suite_of(chosen) if chosen else load_suite(suite)
    displacement = Jitter() if jitter else None
    repeated = rules.repeated(repeats, displacement)
    folder = out or default_folder(policy, suite if not chosen and repeated is rules else repeated.name)
    result = evaluate(
        policy,
        chosen or rules,
        executor=execution.options(),
        out=folder,
        seed=seed,
        options=parse_options(options),
        fresh=fresh,
        repeats=repeats,
        jitter=displacement,
        limits=ProcessLimits.named(parse_options(limits)),
        kernels=kernels,
    )
    summary = result.summary
    print(f"\n{navigation_table({summary.policy: result.metrics}, f'suite {summary.suite.label}').text()}\n")
    written(folder)
    return complaints([f"the policy failed in {summary.errors} episodes"] if summary.errors else [])


@app.command
def record(
    layout: LayoutName,
    policy: str = "astar",
    pair: int = 0,
    out: Path = Path("drive.mp4"),
    seed: int = 0,
    width: int = 480,
    height: int = 360,
    quality: Literal["fast", "fine"] = "fast",
    protocol: OptionalText = None,
    options: PolicyOptions = (),
    start: OptionalText = None,
    goal: OptionalText = None,
) -> int:
    """Film a policy on one goal pair of a layout, or between two points of its floor.

    Args:
        layout: A layout's .json file, or the id of a published layout.
        policy: Policy: a name, module:Class, a file or a URL (see labgym eval --help).
        pair: Index of the goal pair, in the order of the protocol's steps.
        out: The film, .mp4 or .gif.
        seed: Random seed of the policy.
        width: Width in pixels.
        height: Height in pixels.
        quality: fast, or fine with shadows and reflections (ten times slower without a GPU).
        protocol: Id or .json file of the protocol to drive for; by default the one that the layout embeds.
        options: Arguments of the policy, for example trust=true.
        start: Start x,y,yaw in meters and radians, for example 1.5,2,0; by default that of the goal pair.
        goal: Goal x,y in meters; by default that of the goal pair.
    """
    from tqdm import tqdm

    from labgym.cli.describe import episode_outcome
    from labgym.envs.tasks import resolve_layout
    from labgym.eval.drawing import film
    from labgym.eval.driving.drive import drive_pair

    allow_local_modules()
    film.check_film_path(out)
    scene = resolve_layout(layout, protocol)
    ends = numbers("start", start), numbers("goal", goal)
    drive = drive_pair(policy, scene, pair, seed, parse_options(options), *ends)
    print(episode_outcome(drive.row))
    written(film.save_film(tqdm(film.film(scene, drive.route, width, height, quality), "film", len(drive.route)), out))
    return complaints([drive.row.error] if drive.row.error else [])


@app.command
def serve(
    policy: Annotated[Positional[str], arg(metavar="POLICY")],
    host: str = "127.0.0.1",
    port: int = 8888,
    seed: int = 0,
    options: PolicyOptions = (),
) -> int:
    """Serve a policy over HTTP with the NavDP benchmark's protocol, until Ctrl-C.

    Args:
        policy: Policy: a name, module:Class, a file or a URL (see labgym eval --help). Policies that need the true map
            cannot be served.
        host: Address to listen on; anybody who can reach it can use the policy.
        port: Port to listen on; 0 takes a free port.
        seed: Random seed of the policy.
        options: Arguments of the policy, for example trust=true.
    """
    from labgym.policies import make_policy
    from labgym.policies.http.server import NavigationServer

    allow_local_modules()
    arguments = parse_options(options)
    with NavigationServer(lambda: make_policy(policy, **arguments), host, port, seed) as server:
        print(f"Serving {policy} at {server.url}; press Ctrl-C to stop", flush=True)
        with suppress(KeyboardInterrupt):
            server.serve_forever()
    return DONE


@app.command
def reproduce(split: Literal["val", "test"] = "test", out: OptionalPath = None) -> int:
    """Check the published layouts against their hashes, and regenerate them from their seeds.

    They are regenerated only if this version's generator made them; otherwise the release that made them is named.
    Exit 1 if a file or a regenerated layout does not have its hash.

    Args:
        split: The published split.
        out: Also write the layouts that this version makes from the same seeds, with a manifest, to OUT/SPLIT.
    """
    from labgym.layouts import splits

    outcome = splits.reproduce(split, out)
    if out is not None:
        written(out / split)
    print(outcome.notice)
    return complaints(outcome.problems) or findings(())


@app.command
def policies() -> int:
    """List the built-in and registered policies with sensor, required extra and summary."""
    from labgym.policies.registry import policy_table

    print(policy_table())
    return DONE


app.command(submit_app, name="submit", help="Check results that others submit.")
app.command(data)
app.command(train_app, name="train", help="Train a policy, or resume an interrupted training run.")
app.command(ablate_app, name="ablate", help="Run an ablation study of a policy: change one part at a time.")
app.command(card_app, name="card", help="Publish a trained policy with its model card.")


@app.command
def report(folders: Folders, workers: int = 1) -> int:
    """Draw the routes and write tables and report.html for the results in folders.

    Every figure is computed from the episodes. Exit 1 if a summary does not match them, or if files are damaged or were
    changed.

    Args:
        folders: Folders written by labgym run or labgym eval, for example runs/default. The report is written into the
            first and shows the policies of all.
        workers: Number of processes that draw.
    """
    from labgym.pipeline.run import report_folder

    if not folders:
        raise OptionError("no folder of results; name one, for example runs/default")
    outcome = report_folder(folders[0], folders[1:], workers)
    for table in outcome.tables:
        print(f"\n{table.text()}\n")
    print("Written:", *outcome.paths, sep="\n  ")
    return complaints(outcome.problems)


@app.command
def compare(
    folders: Folders,
    policies: Texts = (),
    out: OptionalPath = None,
) -> int:
    """Compare two policies over the episodes that both drove: paired differences with 95% intervals.

    Prints the differences over all shared episodes, then by task, length, detour and protocol. Exit 1 if a summary does
    not match its episodes, or if files are damaged or were changed.

    Args:
        folders: Two folders written by labgym eval, or one folder of labgym run with --policies.
        policies: Names of the two policies, where a folder holds evaluations of several.
        out: A .json file for the comparison.
    """
    from labgym.eval.reports.comparison import chosen_evaluations, compare, comparison_tables

    evaluations = chosen_evaluations(folders, policies)
    comparison = compare(*evaluations)
    for table in comparison_tables(comparison):
        print(f"\n{table.text()}\n")
    if out is not None:
        written(comparison.save(out))
    return complaints([problem for one in evaluations for problem in one.problems])


@app.command
def bench(rounds: int = 15) -> int:
    """Measure speed: the time of each task relative to a comparable reference task.

    Args:
        rounds: Number of timings of each task, at least 2.
    """
    from tqdm import tqdm

    import labgym.bench

    print(labgym.bench.bench_table(list(tqdm(labgym.bench.bench(rounds), "bench"))).text())
    return DONE


@app.command
def coverage(evaluations: int = 4000, seed: int = 0) -> int:
    """Simulate evaluations and print how often the 95% intervals of navigation metrics contain the truth.

    Args:
        evaluations: Number of simulated evaluations per cell of the table.
        seed: Random seed of the simulation.
    """
    from tqdm import tqdm

    from labgym.eval.driving import coverage as simulation

    scenarios = list(simulation.scenarios())
    rows = [simulation.coverage_row(scenario, evaluations, seed) for scenario in tqdm(scenarios, "coverage")]
    print(simulation.coverage_table(rows, evaluations, seed).text())
    return DONE


@app.command
def doctor() -> int:
    """Check this machine: packages, artefacts, renderers; list what is missing and how to install it."""
    import labgym.doctor

    diagnoses = labgym.doctor.examine()
    print(labgym.doctor.report(diagnoses))
    return DONE if labgym.doctor.healthy(diagnoses) else FAILED


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; an error is one line on standard error."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        # A terminal whose encoding lacks a character shows an escape instead of raising an error.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    if words == ["--version"]:
        print(f"labgym {__version__}")
        return DONE
    if words and words[0] in GROUPS:
        words[1:] = GROUPS[words[0]].named(words[1:])
    try:
        with raise_termination():
            return int(
                app.cli(prog="labgym", description=__doc__, args=words or ["--help"], config=(FlagCreatePairsOff,))
            )
    except LabgymError as error:
        return _fail(str(error))
    except BrokenPipeError:
        # The reader of our output has closed the pipe; also silence the flush at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except OSError as error:
        return _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except KeyboardInterrupt as error:
        number = error.number if isinstance(error, Terminated) else signal.SIGINT
        name = f" by {signal.Signals(number).name}" if isinstance(error, Terminated) else ""
        print(f"labgym: interrupted{name}; finished work is kept", file=sys.stderr)
        return SIGNALED + number


def _fail(message: str) -> int:
    line = "".join(char if char.isprintable() else repr(char)[1:-1] for char in message)
    print(f"labgym: error: {line}", file=sys.stderr)
    return BAD_INPUT
