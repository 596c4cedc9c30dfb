"""Generate chemistry laboratories from protocols and benchmark robot navigation in them.

`labgym run` runs the whole pipeline; each other command runs one stage of it. `labgym --version` prints the version.
Exit codes: 0 done, 1 a check or a policy failed, 2 bad input, 130 Ctrl-C, 143 SIGTERM.
"""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from labgym.cli.arguments import (
    ExecutorArguments,
    OptionalText,
    PolicyOptions,
    allow_local_modules,
    parse_options,
)
from labgym.cli.commands import COMMANDS, CommandGroup, refuse_unknown_command, run_command
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import BAD_INPUT, DONE, FAILED, SIGNALED, complaints
from labgym.cli.overview import overview
from labgym.cli.problems import problem_line
from labgym.errors import LabgymError, MissingDependencyError
from labgym.pipeline import RunConfig

SIGNALS = (signal.SIGTERM, signal.SIGHUP)


class Terminated(KeyboardInterrupt):
    """A signal that asks this process to end.

    Attributes:
        number: the signal.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


@contextmanager
def raise_termination() -> Iterator[None]:
    """Raise `Terminated` at the first SIGTERM or SIGHUP in this context; a second one kills the process.

    A signal that is ignored, as SIGHUP is under nohup, stays ignored. Outside the main thread nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    replaced = [number for number in SIGNALS if before[number] is signal.SIG_DFL]
    for number in replaced:
        signal.signal(number, _raise)
    try:
        yield
    finally:
        for number in replaced:
            signal.signal(number, before[number])


def _raise(number: int, _: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)
    raise Terminated(number)


@refuses_idle_flags("run")
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
        options: Arguments of the policy, for example deterministic=false.
    """
    from labgym.policies.http.server import NavigationServer
    from labgym.policies.process import IsolatedPolicy, PolicySource

    allow_local_modules()
    source = PolicySource.named(policy, parse_options(options))

    def report(refusal: str) -> None:
        print(f"labgym: refused a request: {refusal}", file=sys.stderr, flush=True)

    with NavigationServer(lambda: IsolatedPolicy(source), host, port, seed, report) as server:
        print(f"Serving {policy} at {server.url}; press Ctrl-C to stop", flush=True)
        with suppress(KeyboardInterrupt):
            server.serve_forever()
    return DONE


def policies() -> int:
    """List the built-in and registered policies with sensor, required extra and summary."""
    from labgym.policies.registry import policy_table

    print(policy_table())
    return DONE


@refuses_idle_flags("bench")
def bench(rounds: int = 15, growth: bool = False, thinking: bool = False) -> int:
    """Measure speed: each task relative to a comparable reference task, and environments relative to PointMaze.

    Args:
        rounds: Number of timings of each task, at least 2.
        growth: Measure instead how the cost of each task grows with the size of a laboratory or of a suite.
        thinking: Measure instead how long the actions of the built-in policies take, as LabNav charges foreign ones.
    """
    import labgym.bench
    import labgym.growth
    import labgym.throughput
    from labgym.progress import progress_bar

    if growth:
        measured = progress_bar(labgym.growth.growth(), "growth", total=len(labgym.growth.tasks()))
        print(labgym.growth.growth_table(list(measured)).text())
        return DONE
    if thinking:
        print(labgym.bench.thinking_table(list(progress_bar(labgym.bench.thinking(), "thinking"))).text())
        return DONE
    print(labgym.bench.bench_table(list(progress_bar(labgym.bench.bench(rounds), "bench"))).text())
    try:
        speeds = list(progress_bar(labgym.throughput.throughput(rounds), "environments"))
    except MissingDependencyError as error:
        print(f"\nEnvironments are not compared: {error}")
    else:
        print("\n" + labgym.throughput.throughput_table(speeds).text())
    return DONE


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
    try:
        if not words or words[0] in ("-h", "--help"):
            print(overview(), end="")
            return DONE
        group = COMMANDS.get(words[0])
        if isinstance(group, CommandGroup):
            words[1:] = group.named(words[1:])
        refuse_unknown_command(words)
        with raise_termination():
            return run_command(words)
    except LabgymError as error:
        return _fail(str(error))
    except (ImportError, MemoryError, RuntimeError, SystemError, ValueError) as error:
        line = problem_line(error, f"labgym {words[0]}")
        if line is None:
            raise
        return _fail(line)
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
