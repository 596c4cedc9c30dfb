"""No command replaces a file that a user may have edited, unless asked; the same content again is fine."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from laboratories import island_laboratory

from labgym.layouts import Layout

GENERATE = ("generate", "pro_01", "--room", "9x7", "--out", "lab.json")


def refused(call, words: tuple[str, ...], path: str) -> None:
    """Check that a command leaves a file as it is, and names it and the option."""
    before = Path(path).read_bytes()
    code, out, err = call(*words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert path in err
    assert "--overwrite" in err
    assert Path(path).read_bytes() == before


def test_generate_replaces_an_edited_layout_only_when_asked(call):
    assert call(*GENERATE)[:2] == (0, "lab.json\n")
    written = Path("lab.json").read_bytes()
    assert call(*GENERATE)[0] == 0, "the same bytes again lose nothing"
    edited = json.loads(written)
    Path("lab.json").write_text(json.dumps(edited))
    reformatted = Path("lab.json").read_bytes()
    assert call(*GENERATE)[0] == 0, "nor does the same content in another format"
    assert Path("lab.json").read_bytes() == reformatted
    edited["placements"][0]["position"][0] += 0.01
    Path("lab.json").write_text(json.dumps(edited))
    refused(call, GENERATE, "lab.json")
    assert call(*GENERATE, "--overwrite")[0] == 0
    assert Path("lab.json").read_bytes() == written
    Path("lab.json").write_text("notes of mine")
    refused(call, GENERATE, "lab.json")
    assert call(*GENERATE, "--replace")[0] == 0, "the name of the option in earlier versions"
    assert Layout.load("lab.json").provenance.seed == 0


@pytest.mark.parametrize(
    ("form", "out", "file"),
    [
        ("dxf", "plan.dxf", "plan.dxf"),
        ("bom", "list.csv", "list.csv"),
        ("ros", "map", "map/map.yaml"),
    ],
)
def test_compile_replaces_an_edited_file_only_when_asked(call, form, out, file):
    island_laboratory().save("lab.json")
    words = ("compile", "lab.json", "--format", form, "--out", out)
    assert call(*words)[0] == 0
    written = Path(file).read_bytes()
    assert call(*words)[0] == 0
    Path(file).write_bytes(written + b"\n")
    refused(call, words, file)
    assert call(*words, "--overwrite")[0] == 0
    assert Path(file).read_bytes() == written


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (("generate", "pro_01"), "lab.yaml"),
        (("generate", "pro_01", "--count", "2"), "labs.json"),
        (("compile", "lab.json"), "scene.xml"),
        (("compile", "lab.json", "--format", "ros"), "map.yaml"),
        (("compile", "lab.json", "--format", "svg", "--format", "bom"), "lab.svg"),
        (("floors", "--split", "floors-train", "--count", "1"), "floors.json"),
        (("protocols", "stage", "cyc_biginelli"), "mine.yaml"),
        (("protocols", "filter"), "feasible.json"),
        (("assets", "build", "Beaker"), "beaker.usd"),
    ],
)
def test_a_folder_is_not_written_under_the_name_of_a_file(call, words, name):
    island_laboratory().save("lab.json")
    code, out, err = call(*words, "--out", name)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert name in err
    assert [path.name for path in Path().iterdir()] == ["lab.json"]
