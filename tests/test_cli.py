from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import labgym
from labgym.assets import Catalog
from labgym.cli import main
from labgym.cli.commands import COMMANDS as ALL_COMMANDS
from labgym.cli.commands import CommandGroup
from labgym.layouts import Door, Floor, Layout, Placement, load_published, published
from labgym.policies import policy_names
from labgym.protocols import protocols
from runs.killing import hear_interrupts

NAME = published("test")[0]


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Run the command line in an empty folder; returns exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str, str]:
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = int(end.code or 0)
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def one_error_line(outcome: tuple[int, str, str]) -> str:
    code, out, err = outcome
    assert code == 2
    assert out == ""
    assert err.startswith("labgym: error: ")
    assert err.count("\n") == 1
    return err


def test_help_lists_each_command_once_by_kind_of_user_on_one_page(call):
    code, out, _ = call("--help")
    assert code == 0
    listed = [line.split()[0] for line in out.splitlines() if line.startswith("  ")]
    assert sorted(listed) == sorted(ALL_COMMANDS)
    assert len(out.splitlines()) <= 60
    assert max(map(len, out.splitlines())) <= 80
    assert call() == call("-h") == (code, out, "")


def test_the_version_is_the_package_s(call):
    assert call("--version") == (0, f"labgym {labgym.__version__}\n", "")


def test_help_shows_no_internals_of_the_parser(call):
    paths = [(command,) for command in ALL_COMMANDS]
    for name, entry in ALL_COMMANDS.items():
        paths += [(name, command) for command in entry.commands] if isinstance(entry, CommandGroup) else []
    assert len(paths) > 30
    for path in paths:
        code, out, _ = call(*path, "--help")
        assert code == 0, path
        assert f"usage: labgym {' '.join(path)} " in out
        assert "{None" not in out, path
        assert "(default: )" not in out, path
        assert "(default: None)" not in out, path


def test_only_the_module_of_the_named_command_is_imported():
    program = """
import sys
from labgym.cli import main
assert main(["--version"]) == 0
assert "tyro" not in sys.modules
try:
    main(["generate", "--help"])
finally:
    print(*(name for name in sys.modules if name.startswith("labgym.cli.") or name in ("scipy", "pydantic")))
"""
    output = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    imported = set(output.splitlines()[-1].split())
    assert "labgym.cli.layouts" in imported
    assert not {"scipy", "labgym.cli.scores", "labgym.cli.assets", "labgym.cli.training"} & imported


def test_a_question_mark_lists_the_policies(call):
    code, out, _ = call("eval", "--policy", "?")
    assert code == 0
    assert set(policy_names()) <= set(out.split())


def test_an_unknown_command_or_option_says_what_was_given_and_what_there_is(call):
    code, _, err = call("frobnicate")
    assert code == 2
    assert "frobnicate" in err
    assert "doctor" in err
    for words, command, nearest in (
        (("genrate", "sub_01"), "genrate", "generate"),
        (("evaluate", "--policy", "astar"), "evaluate", "eval"),
        (("film", "sub_01"), "film", "record"),
        (("protocols", "validate", "mine.json"), "validate", "check"),
        (("protocols", "chekc", "mine.json"), "chekc", "check"),
        (("assets", "infere", "CCO"), "infere", "infer"),
        (("train", "pp0"), "pp0", "ppo"),
        (("import", "labbuildr", "scene.json"), "labbuildr", "labbuilder"),
        (("reproduce", "comparisons"), "comparisons", "comparison"),
    ):
        line = one_error_line(call(*words))
        assert f"no command {command!r} (nearest: {nearest})" in line
    code, _, err = call("generate", "sub_01", "--sede", "3")
    assert code == 2
    assert "--sede" in err
    assert "--seed" in err


@pytest.mark.parametrize(
    ("arguments", "given", "there"),
    [
        (("assets", "unobtainium"), "unobtainium", "nearest: "),
        (("protocols", "sub_99"), "sub_99", "sub_01"),
        (("generate", "sub_99"), "sub_99", "sub_01"),
        (("generate", "sub_01", "--room", "ballroom"), "ballroom", "two_exits"),
        (("generate", "sub_01", "--profile", "lax"), "lax", "strict"),
        (("generate", "sub_01", "--rules", "fair"), "fair", "paper, touchstone"),
        (("score", NAME[:-1]), NAME[:-1], NAME),
        (("score", NAME, "--profile", "lax"), "lax", "strict"),
        (("view", NAME, "--camera", "ceiling"), "ceiling", "overview"),
        (("eval", "--policy", "oracle"), "oracle", "astar"),
        (("eval", "--suite", "everything"), "everything", "test"),
        (("run", "--policies", "oracle"), "oracle", "astar"),
        (("run", "--profile", "lax"), "lax", "strict"),
    ],
)
def test_an_unknown_name_is_one_line_that_says_what_there_is(call, tmp_path, arguments, given, there):
    line = one_error_line(call(*arguments))
    assert given in line
    assert there in line
    assert files(tmp_path) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ("generate", "sub_01", "--seed", "-1"),
        ("generate", "sub_01", "--seed", "99999999999999999999999"),
        ("view", NAME, "--out", "picture.gif"),
        ("view", NAME, "--camera", "overview", "--width", "100000"),
        ("eval", "--workers", "0"),
        ("run", "--workers", "-2"),
        ("run", "--policies", "astar", "astar"),
        ("report", "no/such/folder"),
        ("score", "no/such/layout.json"),
        ("score", "/dev/null/layout.json"),
        ("protocols", "--validate", "/etc"),
        ("generate", "sub_01", "--out", "/proc/nowhere"),
    ],
)
def test_a_bad_value_is_one_line_and_writes_nothing(call, tmp_path, arguments):
    one_error_line(call(*arguments))
    assert files(tmp_path) == []


def layout_with(**changes: object) -> bytes:
    return json.dumps({**load_published("test", NAME).to_json(), **changes}).encode()


def placement_with(**changes: object) -> bytes:
    data = load_published("test", NAME).to_json()
    return layout_with(placements=[{**data["placements"][0], **changes}, *data["placements"][1:]])


HOSTILE = {
    "empty": b"",
    "blank": b" \n",
    "binary": bytes(range(256)) * 8,
    "truncated": layout_with()[:-200],
    "list": b"[]",
    "number": b"1",
    "null": b"null",
    "nan": layout_with(floor={"walls": [], "spaces": [{"region": [{"x0": float("nan")}]}]}),
    "infinite": placement_with(position=[float("inf"), 0, 0]),
    "huge float": placement_with(position=[1e308, 0, 0]),
    "huge integer": b'{"schema": "labgym.layout/2", "id": ' + b"9" * 5000 + b"}",
    "deep list": b"[" * 100_000 + b"]" * 100_000,
    "deep object": b'{"a":' * 5000 + b"1" + b"}" * 5000,
    "text for number": placement_with(yaw="north"),
    "list for text": placement_with(asset=["FumeHood"]),
    "path as id": layout_with(id="../../../etc/passwd"),
    "path as placement": placement_with(id="../bench"),
    "path as asset": placement_with(asset="../../secrets"),
    "line break as asset": placement_with(asset="Fume\nlabgym: error: Hood"),
    "terminal codes as asset": placement_with(asset="\x1b[2JHood"),
    "unknown asset": placement_with(asset="Cauldron"),
    "unknown support": placement_with(support="nothing", slot=0),
    "itself as support": placement_with(support=load_published("test", NAME).placements[0].id, slot=0),
    "twice the same id": layout_with(placements=[load_published("test", NAME).to_json()["placements"][0]] * 2),
    "unknown field": layout_with(hacked=True),
    "other schema": layout_with(schema="labgym.protocol/1"),
    "no schema": json.dumps({"id": "x"}).encode(),
    "lone surrogate": b'{"schema": "labgym.layout/2", "id": "\\ud800"}',
    "utf-16": layout_with().decode().encode("utf-16"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_layout_is_one_line_that_names_the_file_and_nothing_is_written(call, tmp_path, kind):
    (tmp_path / "evil.json").write_bytes(HOSTILE[kind])
    for command in (("score",), ("view",), ("compile", "--out", "scene"), ("eval", "--layouts")):
        line = one_error_line(call(command[0], *command[1:], "evil.json"))
        assert "evil.json" in line
        assert "\x1b" not in line
        assert len(line) < 2000
        assert files(tmp_path) == ["evil.json"]


@pytest.mark.parametrize("kind", ["empty", "binary", "truncated", "list", "deep list", "other schema", "huge integer"])
def test_a_hostile_protocol_is_one_line_that_names_the_file(call, tmp_path, kind):
    good = json.dumps(protocols()["sub_01"].to_json()).encode()
    broken = {"truncated": good[:-40], "other schema": good.replace(b"labgym.protocol/1", b"labgym.layout/1")}
    (tmp_path / "evil.json").write_bytes(broken.get(kind, HOSTILE[kind]))
    for arguments in (
        ("protocols", "--validate", "evil.json"),
        ("generate", "evil.json"),
        ("score", NAME, "--protocol", "evil.json"),
    ):
        assert "evil.json" in one_error_line(call(*arguments))
    assert files(tmp_path) == ["evil.json"]


def test_a_layout_is_generated_scored_drawn_and_compiled(call, tmp_path):
    code, out, _ = call("generate", "pro_01", "--seed", 3, "--out", "lab.json")
    assert (code, out) == (0, "lab.json\n")
    assert Layout.load(tmp_path / "lab.json").provenance.seed == 3
    code, out, _ = call("score", "lab.json", "--check")
    assert code == 0
    assert "OB ↓" in out
    code, out, _ = call("score", "lab.json", "--json")
    assert json.loads(out)["protocol"] == "pro_01"
    assert call("view", "lab.json", "--out", "lab.svg")[:2] == (0, "lab.svg\n")
    assert call("view", "lab.json", "--out", "lab.pdf")[:2] == (0, "lab.pdf\n")
    assert (tmp_path / "lab.pdf").read_bytes().startswith(b"%PDF")
    for form, target in (("mjcf", "scene"), ("usd", "stage"), ("glb", "lab.glb")):
        code, out, _ = call("compile", "lab.json", "--out", target, "--format", form)
        assert code == 0
        assert Path(out.strip()).is_file()


def test_assets_become_usd_files_that_are_then_current(call, tmp_path):
    assert call("assets", "build", "GlassRod", "烧杯", "--out", "usd")[:2] == (0, "usd\n")
    assert files(tmp_path) == ["usd/instrument/Beaker.usdc", "usd/instrument/GlassRod.usdc"]
    assert call("assets", "build", "GlassRod", "--out", "usd", "--check")[:2] == (0, "no faults\n")
    code, out, _ = call("assets", "build", "Acetone", "--out", "usd", "--check")
    assert (code, "Acetone.usdc is missing" in out) == (1, True)


def test_a_layout_with_violations_fails_its_check(call, tmp_path):
    layout = load_published("test", NAME)
    first, *rest = layout.placements
    layout.replace(placements=(first.model_copy(update={"position": (-3.0, -3.0, 0.0)}), *rest)).save("bad.json")
    assert call("score", "bad.json")[0] == 0
    code, out, _ = call("score", "bad.json", "--check")
    assert code == 1
    assert first.id in out


def test_a_cabinet_in_the_doorway_fails_the_check_without_a_violation(call, tmp_path):
    floor = Floor.rectangle(4.0, 4.0, doors=(Door(wall="front", offset=2.0),))
    cabinet = Placement(id="cabinet", asset="GeneralCabinet", position=(2.0, 0.6, 0.0))
    layout = Layout(id="lab", floor=floor, placements=())
    layout.save("clear.json")
    layout.replace(placements=(cabinet,)).save("blocked.json")
    version = ("--rules", "paper")
    assert call("score", "clear.json", "--check", *version)[0] == 0
    code, out, _ = call("score", "blocked.json", "--check", *version)
    assert code == 1
    assert "violation:" not in out
    assert "facility error: cabinet in the 1.20 x 1.20 m area inside the exit of 'laboratory'" in out


def test_assets_are_found_by_what_people_call_them(call):
    assert call("assets", "rotovap")[1].startswith("RotaryEvaporator\n")
    assert call("assets", "旋转蒸发仪")[1].startswith("RotaryEvaporator\n")
    code, out, _ = call("assets", "--kind", "reagent")
    assert code == 0
    assert "Acetone" in out
    assert "FumeHood" not in out


def test_the_catalogue_passes_its_own_check(call):
    code, out, _ = call("assets", "--check")
    assert (code, out) == (0, "no faults\n")


def test_every_published_protocol_passes_validation(call, tmp_path):
    for name, protocol in protocols().items():
        protocol.save(tmp_path / "p.json")
        assert call("protocols", "--validate", "p.json")[0] == 0, name
    assert len(call("protocols")[1].splitlines()) == 4 + len(protocols())
    assert call("protocols", "sub_01")[1].startswith("sub_01 ")


def test_a_protocol_that_breaks_the_suite_fails_validation(call, tmp_path):
    data = protocols()["sub_01"].to_json()
    data["steps"][0]["location"] = "Acetone"
    (tmp_path / "p.json").write_text(json.dumps(data))
    code, out, _ = call("protocols", "--validate", "p.json")
    assert code == 1
    assert "Acetone" in out


def test_evaluation_and_report_from_the_command_line(call, tmp_path):
    code, out, _ = call("eval", "--layouts", NAME, "--out", "e")
    assert code == 0
    assert "SPL ↑" in out
    rows = [json.loads(line) for line in (tmp_path / "e" / "episodes.jsonl").read_text().splitlines()]
    assert {row["policy"] for row in rows} == {"astar"}
    code, out, _ = call("report", "e")
    assert code == 0
    assert (tmp_path / "e" / "report.html").is_file()
    assert (tmp_path / "e" / "pictures" / f"{NAME}.png").is_file()


def test_a_reader_that_goes_away_is_no_error():
    command = f"{sys.executable} -m labgym.cli assets | head -1"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert "assets" in done.stdout


def test_ctrl_c_is_one_line_and_leaves_readable_files(tmp_path):
    command = [
        sys.executable,
        "-m",
        "labgym.cli",
        "eval",
        "--policy",
        "random",
        "--suite",
        "val",
        "--out",
        str(tmp_path / "e"),
    ]
    with subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=hear_interrupts,
    ) as process:
        deadline = time.monotonic() + 600
        while not (tmp_path / "e" / "ledger.jsonl").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=300)
    assert "Traceback" not in err
    assert err.strip().splitlines()[-1] == "labgym: interrupted; finished work is kept"
    assert process.returncode == 130
    documents = [path for path in (tmp_path / "e").rglob("*.json*") if path.is_file()]
    assert documents
    for path in documents:
        for line in path.read_text().splitlines() if path.suffix == ".jsonl" else [path.read_text()]:
            json.loads(line)


def test_an_asset_is_shown_with_its_description_and_its_caption(call):
    code, out, _ = call("assets", "rotovap")
    asset = Catalog.published().get("RotaryEvaporator")
    assert code == 0
    assert out.splitlines()[:3] == [asset.name, asset.description, asset.caption]


def test_help_says_that_an_asset_is_shown_without_the_word_show(call):
    assert "labgym assets NAME` works without `show`" in " ".join(call("assets", "--help")[1].replace("│", " ").split())
