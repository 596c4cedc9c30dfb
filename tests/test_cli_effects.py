"""Flags that other flags leave without effect are refused in one line before a command does anything."""

from __future__ import annotations

import inspect
import json
import shlex
from dataclasses import fields, is_dataclass

import pytest

from labgym.cli import main
from labgym.cli.commands import COMMANDS, CommandGroup, command_function
from labgym.cli.effects import EXECUTION, IDLE
from labgym.eval.labnav.summary import LabNavSummary
from labgym.pipeline import RunConfig

LAYOUT = "test-sub_01"
ALL_EFFECTIVE = {
    "compare", "move", "repair", "outline", "import labbuilder", "serve", "policies", "floors", "coverage", "doctor",
    "submit pack",
    "assets build", "assets compat", "assets infer", "assets find", "assets add-reagent",
    "protocols search", "protocols check", "protocols export", "protocols survey", "protocols stage",
    "protocols score-reading",
    "reproduce published", "reproduce protocols", "reproduce labbuilder", "reproduce comparison", "reproduce ablation",
    "reproduce navigation", "reproduce repair", "reproduce nuisances", "reproduce all",
    "train ppo", "train recurrent-ppo", "train sac", "train her", "train floors",
    "train iplanner", "train navdp", "train ppo-imitation",
    "train local-practice", "train local-imitation", "train local-ppo",
    "ablate iplanner", "ablate navdp", "ablate local-imitation", "ablate local-ppo",
    "card iplanner", "card navdp", "card local-imitation", "card local-ppo",
}  # fmt: skip
"""Commands of whose flags none leaves another one without effect, apart from those that exclude each other."""
CASES = [
    ("bench --growth --rounds 3", "--rounds"),
    ("bench --thinking --rounds 3", "--rounds"),
    ("bench --thinking --growth", "--growth"),
    ("generate sub_01 --shard 5", "--shard"),
    ("generate sub_01 --fresh", "--fresh"),
    ("generate sub_01 --workers 2", "--workers"),
    ("generate sub_01 --executor dask --scheduler tcp://127.0.0.1:1", "--executor"),
    ("generate sub_01 --only-have", "--only-have"),
    ("generate sub_01 --extra", "--extra"),
    ("generate sub_01 --explain --proposer sampler", "--explain"),
    ("generate sub_01 --no-optimise --adjuster llm", "--adjuster"),
    ("generate sub_01 --library a.json", "--library"),
    *((f"generate sub_01 --rules labbuilder --library catalog {flag}", flag.split()[0]) for flag in (
        "--profile strict", "--explain", "--trace t.json", "--count 2 --out batch",
    )),
    *((f"generate sub_01 --count 2 --out batch {flag}", flag.split()[0]) for flag in (
        "--explain", "--have a.csv", "--fixed a.csv", "--service water:left", "--trace a.json", "--overwrite")),
    *((f"score {LAYOUT} --regulations US {flag}", flag.split()[0]) for flag in (
        "--protocol sub_02", "--profile strict", "--rules paper", "--out scores", "--judge strict",
        "--samples 4", "--fresh", "--workers 2")),
    (f"score {LAYOUT} --library a.json", "--library"),
    *((f"score {LAYOUT} --rules labbuilder --library a.json {flag}", flag.split()[0]) for flag in (
        "--protocol sub_02", "--profile strict", "--check", "--out scores", "--workers 2")),
    (f"score {LAYOUT} --rules labbuilder --judge strict --library a.json", "--library"),
    (f"score {LAYOUT} --fresh", "--fresh"),
    (f"score {LAYOUT} --samples 4", "--samples"),
    (f"score {LAYOUT} --workers 2", "--workers"),
    (f"compile {LAYOUT} --out scene --loose", "--loose"),
    *((f"view --task people {flag}", flag.split()[0]) for flag in (
        "--suite val", "--protocol sub_01", "--camera overview", "--pair 1", "--policy bug2", "--port 1",
        "--options a=1")),
    (f"view {LAYOUT} --task people", "LAYOUTS"),
    (f"view {LAYOUT} --level 3", "--level"),
    (f"view {LAYOUT} --episode a/0", "--episode"),
    *((f"view {LAYOUT} --web {flag}", flag.split()[0]) for flag in (
        "--out a.png", "--camera overview", "--width 9", "--height 9", "--suite val")),
    *((f"view {LAYOUT} {flag}", flag.split()[0]) for flag in (
        "--suite val", "--policy bug2", "--pair 1", "--options a=1", "--port 1", "--seed 1", "--width 9")),
    ("view --task people --episode floors-val-0003/1 --seed 1", "--seed"),
    ("view --task people-1 --level 3", "--level"),
    ("data --format parquet --task people-1 --level 3", "--level"),
    ("play --task people-2 --film a.gif", "--film"),
    ("eval --task people-2 --jitter", "--jitter"),
    ("play --suite labnav-val-people --protocol sub_01", "--protocol"),
    ("play --suite labnav-val-people --film a.gif", "--film"),
    (f"play {LAYOUT} --suite val", "--suite"),
    ("play --name me", "--name"),
    *((f"trace trace.json {flag}", flag.split()[0]) for flag in (
        "--profile strict", "--protocol sub_01", "--save a.json")),
    *((f"eval --suite labnav-mini {flag}", flag.split()[0]) for flag in (
        "--protocol sub_01", "--repeats 2", "--jitter")),
    ("eval --latency 0.1", "--latency"),
    ("eval --protocol sub_01", "--protocol"),
    (f"eval --suite val --layouts {LAYOUT}", "--suite"),
    ("report results --workers 2", "--workers"),
    *((f"record results --episode a/0 {flag}", flag.split()[0]) for flag in (
        "--pair 1", "--protocol sub_01", "--start 1,1,0", "--goal 1,1", "--seed 1", "--options a=1")),
    (f"record {LAYOUT} --pair 1 --start 1,1,0 --goal 2,2", "--pair"),
    (f"record {LAYOUT} --episode a/0", "--episode"),
    *((f"record {LAYOUT} --out a.mcap {flag}", flag.split()[0]) for flag in (
        "--width 99", "--height 99", "--quality fine")),
    ("run --out a --name b", "--name"),
    ("labnav --split floors-sealed --out a --seed 1", "--seed"),
    ("labnav --split floors-val --out a --level 1 --no-unfiltered", "--no-unfiltered"),
    ("describe splits --published --floors 3", "--floors"),
    ("describe splits --published --own", "--own"),
    ("describe splits --own --seed 1", "--seed"),
    ("describe splits --fresh", "--fresh"),
    *((f"submit check results --no-drive {flag}", flag.split()[0]) for flag in (
        "--seed 1", "--policy a:B", "--options a=1")),
    ("submit check results --options a=1", "--options"),
    *((f"submit check results {flag}", flag.split()[0]) for flag in (
        "--secret-file a.txt", "--out b", "--workers 2")),
    ("leaderboard --workers 2", "--workers"),
    *((f"data {flag}", flag.split()[0]) for flag in (
        "--task people", "--level 1", "--split val", "--policy astar", "--sensors lidar", "--episodes 1",
        "--successful", "--led 0.1")),
    *((f"data --format parquet {flag}", flag.split()[0]) for flag in (
        "--samples 1", "--floors 0.1", "--learner a", "--led 0.1")),
    ("card ppo --results a --run b --out c --observation depth", "--observation"),
    ("assets show rotovap --check", "NAME"),
    ("assets show --check --kind reagent", "--kind"),
    ("assets show rotovap --kind reagent", "--kind"),
    ("assets add a.glb --workers 2", "--workers"),
    ("protocols show sub_01 --validate a.json", "NAME"),
    ("protocols new text --repairs 1", "--repairs"),
    ("protocols new text --explain --model", "--model"),
    ("protocols new text --explain --keyword-only", "--keyword-only"),
    ("protocols experiments a --type redox", "--type"),
    ("protocols import a --format ord --out b --product c", "--product"),
    ("protocols filter --overwrite", "--overwrite"),
]  # fmt: skip


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Change to a folder with the head of a trace, and of results of LabNav."""
    (tmp_path / "trace.json").write_text('{"schema": "labgym.trace/1"}')
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "summary.json").write_text(json.dumps({"schema": LabNavSummary.SCHEMA}))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("line", "flag"), CASES)
def test_a_flag_without_effect_is_refused_before_anything_is_done(place, capsys, line, flag):
    before = sorted(place.rglob("*"))
    assert main(shlex.split(line)) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"labgym: error: {flag} has no effect ")
    assert captured.err.count("\n") == 1
    assert sorted(place.rglob("*")) == before


def test_every_flag_of_the_table_has_a_case():
    for command, rules in IDLE.items():
        words = command.split()
        flags = {flag for line, flag in CASES if line.split()[: len(words)] == words}
        for name in {name for rule in rules for name in rule.flags} - {*EXECUTION[1:]}:
            spelled = {f"--{name.replace('_', '-')}", f"--no-{name.replace('_', '-')}", name.upper()}
            assert spelled & flags, (command, name)


def commands():
    """Return the function of every command by its name."""
    references = {}
    for name, entry in COMMANDS.items():
        if isinstance(entry, CommandGroup):
            references |= {f"{name} {command}": reference for command, reference in entry.commands.items()}
        else:
            references[name] = entry
    return {name: command_function(reference) for name, reference in references.items()}


def test_every_command_is_audited_and_the_table_names_its_parameters():
    functions = commands()
    assert set(functions) == set(IDLE) | ALL_EFFECTIVE
    for command, rules in IDLE.items():
        parameters = dict(inspect.signature(functions[command]).parameters)
        parameters |= {field.name: field for field in fields(RunConfig)} if command == "run" else {}
        for each in list(parameters.values()):
            if is_dataclass(each.default):
                parameters |= {field.name: field for field in fields(each.default)}
        for rule in rules:
            assert set(rule.flags) <= set(parameters), command
