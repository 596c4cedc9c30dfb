from __future__ import annotations

import itertools
import math
from dataclasses import replace

import gymnasium as gym
import pytest

from labgym import bench, growth, throughput
from labgym.cli import main
from labgym.eval.labnav.latency import Probe
from labgym.layouts import load_published, published


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

    timing = bench.timed(bench.SpeedComparison("a", "b", takes(3.0), takes(2.0)), rounds=4)
    assert (timing.seconds, timing.reference, timing.ratio) == (3.0, 2.0, 1.5)
    assert timing.low == timing.high == 1.5
    assert next(now) == 2 * 2 + 2 * 4


def test_work_and_reference_of_the_quick_pieces_run_and_are_timed():
    layout = load_published("val", published("val")[0])
    for piece in (bench._control_step, bench._lidar, bench._shortest_path, bench._restart):
        timing = bench.timed(piece(layout), rounds=2, block=1e-6)
        assert timing.seconds > 0.0
        assert timing.reference > 0.0


@pytest.mark.slow
def test_the_command_times_every_piece(capsys):
    assert main(["bench", "--rounds", "2"]) == 0
    printed = capsys.readouterr().out
    for piece in (
        "control step",
        "lidar scan",
        "shortest path",
        "reset in a loaded layout",
        "generating a room",
        "reset in a new layout that a pool has prepared",
        "reset in a random layout of the split test",
        "policy in its own process",
        "relative to PointMaze_UMaze-v3",
        "lidar, MuJoCo",
        "color and depth camera, MuJoCo",
    ):
        assert piece in printed


def test_one_round_is_refused():
    assert main(["bench", "--rounds", "1"]) == 2


def test_the_table_gives_milliseconds_and_the_ratio_with_its_quartiles():
    (row,) = bench.bench_table([bench.Timing("x", "y", 0.002, 0.001, 2.0, 1.5, 2.5)]).rows
    assert row == ("x", "2.000", "y", "1.000", "2.000 [1.500, 2.500]")


def test_a_faster_environment_has_a_larger_ratio(monkeypatch):
    """With a fake clock: steps of the reference take 4 ms, ours 2 ms; the vector environment has 3 environments."""
    clock = [0.0]
    for name in ("perf_counter", "process_time"):
        monkeypatch.setattr(throughput.time, name, lambda: clock[0])

    class Env:
        def __init__(self, seconds, count=None):
            self.seconds, self.resets = seconds, 0
            self.action_space = gym.spaces.Box(-1.0, 1.0, (2,) if count is None else (count, 2))
            if count is not None:
                self.num_envs = count

        def reset(self, **_):
            self.resets += 1

        def step(self, action):
            clock[0] += self.seconds
            return None, 0.0, True, False, {}

        def close(self):
            pass

    single, many = Env(0.002), Env(0.002, count=3)
    made = {throughput.REFERENCE: lambda: Env(0.004), "single": lambda: single, "many": lambda: many}
    monkeypatch.setattr(throughput, "environments", lambda layout: made)
    reference, one, three = throughput.throughput(2)
    assert (reference.wall, reference.processor) == (1.0, 1.0)
    assert (round(one.wall, 9), round(one.steps)) == (2.0, 500)
    assert (round(three.processor, 9), round(three.steps)) == (6.0, 1500)
    assert single.resets > 10
    assert many.resets == 1


def test_a_line_names_the_extra_whose_environments_are_not_measured(monkeypatch):
    monkeypatch.setattr(throughput, "find_spec", lambda name: object())
    assert throughput.left_out() == ()
    monkeypatch.setattr(throughput, "find_spec", lambda name: None if name == "warp" else object())
    (line,) = throughput.left_out()
    assert "pip install 'labgym-nav[warp]'" in line
    assert line in throughput.throughput_table([]).notes


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.8])
def test_the_exponent_of_a_power_law_is_found(exponent):
    sizes = (107, 244, 544, 800)
    row = growth.Growth("repair", "objects", sizes, tuple(3e-5 * size**exponent for size in sizes))
    assert row.exponent == pytest.approx(exponent)
    assert growth.growth_table([row]).rows[0][3] == f"{exponent:.2f}"


def test_the_exponent_is_the_slope_that_least_squares_gives_by_hand():
    row = growth.Growth("x", "objects", (1, 10, 100), (1.0, 100.0, 1000.0))
    assert row.exponent == pytest.approx(math.log10(1000.0) / 2.0)


def test_processor_time_is_the_least_of_some_calls_and_long_work_is_done_once(monkeypatch):
    clock, durations = [0.0], iter([0.2, 0.1, 0.15, 7.0])
    monkeypatch.setattr(growth.time, "process_time", lambda: clock[0])

    def work():
        clock[0] += next(durations)

    assert growth.cpu_seconds(work) == pytest.approx(0.1)
    assert growth.cpu_seconds(work) == pytest.approx(7.0)


def test_a_repair_moves_three_in_a_hundred_objects(monkeypatch):
    damaged = []
    monkeypatch.setattr(growth, "repair_layout", lambda layout, protocol: damaged.append(layout))
    growth._repair(0)()
    before = growth._floor(0)
    moved = [p.id for p in before.placements if damaged[0].placement(p.id).position != p.position]
    assert len(moved) >= round(0.03 * len(before.placements))


@pytest.mark.slow
def test_the_command_prints_the_growth_of_every_task(monkeypatch, capsys):
    monkeypatch.setattr(growth, "FLOORS", growth.FLOORS[:2])
    monkeypatch.setattr(growth, "EPISODES", (30, 300))
    assert main(["bench", "--growth"]) == 0
    output = capsys.readouterr()
    for name in growth.tasks():
        assert name in output.out
    assert f"{len(growth.tasks())}/{len(growth.tasks())}" in output.err


def test_the_thinking_of_a_policy_is_a_row_and_what_is_not_measured_is_named():
    rows = list(bench.thinking(("still", "clairvoyant")))
    assert (rows[0].probe.steps, rows[0].probe.basis, rows[1].probe) == (50, "CPU time", None)
    still = replace(rows[0], probe=Probe(seconds=0.0112, basis="CPU time", steps=50))
    table = bench.thinking_table([still, rows[1]])
    assert table.rows == (("still", "11.20", "CPU time", "0.1", "0"), ("clairvoyant", "-", "-", "-", "0"))
    assert "clairvoyant is not measured: it drives in the process that simulates." in table.notes
