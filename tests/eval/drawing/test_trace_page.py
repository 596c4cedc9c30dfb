"""`labgym trace`: the page and the film of a trace."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from laboratories import island_laboratory
from PIL import Image

from labgym.cli import main
from labgym.eval.drawing.trace_frames import draw_curves, trace_states
from labgym.layouts import Layout
from labgym.layouts.moves import Move, apply
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.refinement import refine_assessed
from labgym.layouts.trace import Recorder, Trace


@pytest.fixture(scope="module")
def spoilt() -> Layout:
    """The island stands in the sink bench, in the way of the robot."""
    return apply(island_laboratory(), Move("IslandBench1800_1", 1.4, 2.6))


@pytest.fixture(scope="module")
def trace(spoilt: Layout) -> Trace:
    recorder, protocol = Recorder(), spoilt.protocols[0]
    layout, assessment = optimise_assessed(spoilt, protocol, trace=recorder, rules="paper")
    refine_assessed(layout, assessment, protocol, trace=recorder)
    return recorder.trace()


@pytest.fixture(scope="module")
def page(trace: Trace, tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("trace")
    trace.save(folder / "trace.json")
    assert main(["trace", str(folder / "trace.json"), "--out", str(folder / "trace.html")]) == 0
    return (folder / "trace.html").read_text()


def test_the_page_has_a_plan_for_each_state_and_a_row_for_each_iteration(trace: Trace, page: str) -> None:
    accepted = sum(iteration.accepted for iteration in trace.iterations)
    assert accepted > 0
    assert page.count("data:image/png;base64,") == 1 + accepted
    assert page.count("<tr><th>") == 1 + len(trace.iterations)
    assert "refused" in page


def test_the_page_loads_nothing_from_elsewhere(page: str) -> None:
    assert not re.search(r"(src|href)=\"(?!data:)", page)
    assert "default-src 'none'" in page


def test_texts_of_a_file_from_elsewhere_are_escaped(trace: Trace, tmp_path: Path) -> None:
    data = json.loads(json.dumps(trace.to_json()))
    attack = "<script>alert(1)</script>"
    trial = {
        "operator": attack,
        "verdict": "invalid",
        "note": attack,
        "commands": [{"kind": attack}],
        "worse": {attack: 1},
    }
    data["iterations"][0] |= {"level": attack, "trials": [trial]}
    (tmp_path / "trace.json").write_text(json.dumps(data))
    assert main(["trace", str(tmp_path / "trace.json"), "--out", str(tmp_path / "trace.html")]) == 0
    assert attack not in (tmp_path / "trace.html").read_text()


def test_the_curves_show_the_figures(trace: Trace) -> None:
    from matplotlib.figure import Figure

    panels = [Figure().add_subplot() for _ in range(4)]
    draw_curves(panels, trace)
    figures = [iteration.figures for iteration in trace.iterations]
    drawn = [line.get_ydata() for panel in panels[:3] for line in panel.lines]
    expected = [[each.v for each in figures], [each.errors for each in figures]]
    expected += [[each.fitness for each in figures], [each.unreachable / each.transitions for each in figures]]
    for line, values in zip(drawn, expected, strict=True):
        np.testing.assert_allclose(np.asarray(line, dtype=float), values)
    heights = [sum(bar.get_height() for bar in panels[3].patches if bar.get_x() + bar.get_width() / 2 == number)
               for number in range(len(figures))]  # fmt: skip
    starts = [sum(trial.verdict == "start" for trial in each.trials) for each in trace.iterations]
    assert heights == [each.tried - start for each, start in zip(trace.iterations, starts, strict=True)]


def test_of_many_states_the_first_and_the_last_are_drawn(trace: Trace) -> None:
    states = trace_states(trace, most=2)
    assert states[0].number == 0
    assert states[-1].layout.placements == trace.final().placements


def test_a_layout_is_repaired_and_filmed(spoilt: Layout, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spoilt.save(tmp_path / "lab.json")
    words = ["trace", str(tmp_path / "lab.json"), "--out", str(tmp_path / "t.gif"), "--save", str(tmp_path / "t.json")]
    assert main(words) == 0
    saved = Trace.load(tmp_path / "t.json")
    assert saved.start.hash == spoilt.hash
    assert saved.iterations[-1].figures.v < saved.iterations[0].figures.v
    with Image.open(tmp_path / "t.gif") as film:
        assert getattr(film, "n_frames", 1) == 1 + sum(iteration.accepted for iteration in saved.iterations)


@pytest.mark.parametrize(
    ("content", "words", "expected"),
    [
        (None, [], "no such file"),
        ("{}", [], "schema"),
        ('{"schema": "labgym.trace/2"}', [], "labgym.trace/1"),
        ('{"schema": "labgym.trace/1"}', [], "profile"),
        ("[1]", ["--out", "t.png"], ".html"),
    ],
)
def test_what_is_no_trace_is_refused_in_one_line(
    content: str | None, words: list[str], expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.json"
    if content is not None:
        path.write_text(content)
    assert main(["trace", str(path), *words]) == 2
    err = capsys.readouterr().err
    assert err.startswith("labgym: error: ")
    assert err.count("\n") == 1
    assert expected in err
