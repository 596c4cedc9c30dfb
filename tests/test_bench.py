from __future__ import annotations

import itertools

from labgym import bench
from labgym.cli import main


def test_a_ratio_is_of_the_medians_that_the_clock_gave(monkeypatch):
    # A fake clock: the work always takes 3 s, the reference 2 s.
    now = itertools.count()
    clock = [0.0]
    monkeypatch.setattr(bench.time, "perf_counter", lambda: clock[0])

    def takes(seconds):
        def work():
            next(now)
            clock[0] += seconds

        return work

    timing = bench.timed(bench.Comparison("a", "b", takes(3.0), takes(2.0)), rounds=4)
    assert (timing.seconds, timing.reference, timing.ratio) == (3.0, 2.0, 1.5)
    assert timing.low == timing.high == 1.5
    assert next(now) == 2 * 2 + 2 * 4


def test_the_command_times_every_piece(capsys):
    assert main(["bench", "--rounds", "2"]) == 0
    printed = capsys.readouterr().out
    for piece in (
        "control step",
        "lidar scan",
        "shortest path",
        "reset in a loaded layout",
        "generating a room",
        "a pool has prepared",
        "policy in its own process",
    ):
        assert piece in printed
    assert main(["bench", "--rounds", "1"]) == 2


def test_the_table_gives_milliseconds_and_the_ratio_with_its_quartiles():
    (row,) = bench.bench_table([bench.Timing("x", "y", 0.002, 0.001, 2.0, 1.5, 2.5)]).rows
    assert row == ("x", "2.000", "y", "1.000", "2.000 [1.500, 2.500]")
