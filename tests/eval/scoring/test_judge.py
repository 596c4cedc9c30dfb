"""The semantic judge over a real connection: pictures, rubric, hard zeros, samples and their spread."""

from __future__ import annotations

import base64
import io
import json
import statistics

import pytest
from PIL import Image

from labgym.cli import main
from labgym.errors import OptionError, UnknownNameError
from labgym.eval import LayoutReport, aggregate, score
from labgym.eval.reports.tables import layout_table
from labgym.eval.scoring import judge
from labgym.eval.scoring.judge import TEMPERATURE, Judge, judged_views
from labgym.eval.scoring.judgement import HARD_ZEROS, MODES, Judgement, JudgeOptions, Sample
from labgym.eval.scoring.many import read_scores, score_layouts
from labgym.layouts import load_published
from labgym.layouts.floors import draw_floor
from labgym.layouts.model import Layout
from labgym.llm import LanguageModelError

PICTURES = judge.pictures
KEY = "sk-loopback-0123456789"
LAYOUT = load_published("test", "test-sub_02")


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch):
    """Small pictures, each rendered once: what is on them plays no role here."""
    for name, value in {"WIDTH": 32, "HEIGHT": 18, "SAMPLES": 1}.items():
        monkeypatch.setattr(judge, name, value)
    monkeypatch.setattr(judge, "pictures", _rendered)


RENDERED = {}


def _rendered(layout, protocol):
    if layout.hash not in RENDERED:
        RENDERED[layout.hash] = PICTURES(layout, protocol)
    return RENDERED[layout.hash]


@pytest.fixture(scope="module")
def report() -> LayoutReport:
    return score(LAYOUT, contacts=False, rules="paper")


def verdict(realism=8.0, layout=7.0, completeness=6.0, zeros=()):
    scores = {"realism": realism, "layout": layout, "completeness": completeness}
    return json.dumps(
        {name: {"score": points, "reason": "as seen"} for name, points in scores.items()} | {"hard_zeros": list(zeros)}
    )


def test_the_scores_are_means_over_the_samples_and_the_report_has_a_total(report, loopback, model_at):
    for realism in (8.0, 6.0, 7.0):
        loopback.says(verdict(realism))
    done = Judge(model_at()).completed(report, LAYOUT)
    assert (done.real, done.lay, done.comp) == (7.0, 7.0, 6.0)
    assert done.s_consist == 20.0
    assert done.total == pytest.approx(report.s_phys + report.s_chem + 20.0)
    judgement = done.judgement
    assert (len(judgement.samples), judgement.unusable) == (3, 0)
    assert judgement.spread("realism") == judgement.spread() == 2.0
    assert judgement.spread("layout") == 0.0
    assert statistics.mean(sample.total for sample in judgement.samples) == pytest.approx(done.s_consist)
    assert done.consistency_proxy == report.consistency_proxy, "the proxy keeps its own columns"


def test_a_table_has_the_models_columns_only_if_a_model_has_judged(report, loopback, model_at):
    loopback.says(verdict())
    done = Judge(model_at()).completed(report, LAYOUT)
    assert "Real ↑" in layout_table(aggregate([done])).columns
    assert "8.00" in layout_table(aggregate([done])).rows[0]
    assert "Real ↑" not in layout_table(aggregate([report])).columns


def test_a_report_without_a_judge_has_the_bytes_of_before(report):
    assert "judgement" not in report.to_json()
    assert "version" not in report.to_json()["consistency_proxy"]
    assert report.real is None
    assert report.total is None


def test_a_judged_report_survives_a_file(report, loopback, model_at, tmp_path):
    loopback.says(verdict())
    done = Judge(model_at()).completed(report, LAYOUT)
    assert LayoutReport.load(done.save(tmp_path / "report.json")) == done


@pytest.mark.parametrize(("condition", "dimension"), HARD_ZEROS.items())
def test_a_hard_zero_is_zero_whatever_the_figure(condition, dimension):
    sample = Sample.model_validate(json.loads(verdict(9.0, 9.0, 9.0, [condition])))
    assert sample.points(dimension) == 0.0
    assert sample.total == 18.0


def test_the_model_sees_the_floor_from_above_its_corners_and_the_places_of_work(loopback, model_at):
    loopback.says(verdict())
    judgement = Judge(model_at(), JudgeOptions(samples=1)).judge(LAYOUT)
    text, *images = loopback.requests[0]["messages"][1]["content"]
    sent = [base64.b64decode(image["image_url"]["url"].partition(",")[2]) for image in images]
    assert len(sent) == len(judgement.pictures) <= 16
    assert all(Image.open(io.BytesIO(png)).size == (32, 18) for png in sent)
    assert judgement.pictures[0] == "topdown"
    assert sum(name.startswith("corner ") for name in judgement.pictures) == 4
    located = [LAYOUT.find(name).id for name in LAYOUT.protocol.locations]
    assert set(located[:4]) <= set(judgement.pictures)
    assert all(name in text["text"] for name in judgement.pictures)


def test_corners_look_at_the_middle_from_inside_of_every_space():
    floor = draw_floor("suite", 4).floor
    cameras = judged_views(Layout(id="bare", floor=floor, placements=()), None)
    corners = {name: view for name, view in cameras.items() if name.startswith("corner ")}
    assert 1 <= len(corners) <= 4
    for name, view in corners.items():
        space = floor.space(name.rpartition(" of ")[2])
        assert floor.space_at(*view.position[:2]) == space
        assert view.position[2] < space.ceiling


def test_the_question_holds_rubric_protocol_and_mode(loopback, model_at):
    loopback.says(verdict())
    texts = {}
    for mode in MODES:
        Judge(model_at(), JudgeOptions(mode, 1)).judge(LAYOUT)
        system, user = loopback.requests[-1]["messages"]
        texts[mode] = system["content"]
        assert LAYOUT.protocol.name in user["content"][0]["text"]
        assert all(name in user["content"][0]["text"] for name in LAYOUT.protocol.required_assets())
        assert all(condition in system["content"] for condition in HARD_ZEROS)
    assert len(set(texts.values())) == 3
    shared = {text.partition("Rigor: ")[0] for text in texts.values()}
    assert len(shared) == 1, "all modes share the definitions"


def test_samples_differ_in_their_seed_and_are_replayed(loopback, model_at, tmp_path):
    loopback.says(verdict())
    first = Judge(model_at(cache=tmp_path)).judge(LAYOUT)
    assert [request["seed"] for request in loopback.requests] == [0, 1, 2]
    assert {request["temperature"] for request in loopback.requests} == {TEMPERATURE}
    again = Judge(model_at(cache=tmp_path, replay=True)).judge(LAYOUT)
    assert again == first
    assert len(loopback.requests) == 3
    assert all(KEY.encode() not in path.read_bytes() for path in tmp_path.rglob("*.json"))


@pytest.mark.parametrize(
    "text",
    [
        "A lovely laboratory. 9 out of 10.",
        verdict()[:-20],
        json.dumps({"realism": 8, "layout": 7, "completeness": 6, "hard_zeros": []}),
        verdict(realism=11.0),
        verdict(layout=float("nan")),
        verdict(zeros=["too_ugly"]),
        json.dumps(json.loads(verdict()) | {"overall": 30}),
        json.dumps(json.loads(verdict()) | {"realism": {"score": 8, "reason": "x" * 5000}}),
    ],
    ids=range(8),
)
def test_an_answer_of_another_form_is_repaired_or_an_error(loopback, model_at, text):
    loopback.says(text)
    loopback.says(verdict())
    assert Judge(model_at(), JudgeOptions(samples=1)).judge(LAYOUT).s_consist == 21.0
    loopback.script.clear()
    loopback.says(text)
    before = len(loopback.requests)
    with pytest.raises(LanguageModelError) as caught:
        Judge(model_at(), JudgeOptions(samples=1)).judge(LAYOUT)
    assert caught.value.reason == "malformed"
    assert "\n" not in str(caught.value)
    assert len(loopback.requests) - before == 3


def test_unusable_samples_are_counted_and_not_replaced(loopback, model_at):
    loopback.says(verdict(8.0))
    loopback.says("", message={"refusal": "I do not judge."})
    loopback.says(verdict(4.0))
    judgement = Judge(model_at()).judge(LAYOUT)
    assert (len(judgement.samples), judgement.unusable) == (2, 1)
    assert judgement.mean("realism") == 6.0


def test_if_no_sample_can_be_used_there_is_no_judgement(loopback, model_at):
    loopback.says("", message={"refusal": "I do not judge."})
    with pytest.raises(LanguageModelError, match="refuses"):
        Judge(model_at()).judge(LAYOUT)


@pytest.mark.parametrize(("mode", "samples", "error"), [("harsh", 3, UnknownNameError), ("strict", 0, OptionError)])
def test_options_out_of_range_are_refused(mode, samples, error):
    with pytest.raises(error):
        JudgeOptions(mode, samples)


@pytest.fixture
def configured(loopback, monkeypatch):
    for name, value in {"BASE_URL": loopback.url, "MODEL": "eyes", "API_KEY": KEY}.items():
        monkeypatch.setenv(f"LABGYM_LLM_{name}", value)


def test_the_command_prints_the_models_scores_beside_the_others(configured, loopback, capsys, tmp_path):
    loopback.says(verdict(zeros=["blocked_exit"]))
    assert main(["score", "test-sub_02", "--judge", "strict", "--samples", "2"]) == 0
    printed = capsys.readouterr().out
    words = " ".join(printed.split())
    assert "S_consist 14.0 of 30, spread 0.0 (eyes, strict, 2 samples)" in words
    assert "hard zeros blocked_exit" in words
    assert KEY not in printed


def test_without_a_model_the_command_names_what_to_set(monkeypatch, capsys):
    monkeypatch.delenv("LABGYM_LLM_BASE_URL", raising=False)
    assert main(["score", "test-sub_02", "--judge", "medium"]) == 2
    assert "LABGYM_LLM_BASE_URL" in capsys.readouterr().err


def test_many_layouts_are_judged_into_a_folder_that_names_the_judge(configured, loopback, tmp_path):
    loopback.says(verdict())
    out, options = tmp_path / "scores", JudgeOptions("lenient", 1)
    rows = list(score_layouts(lambda: [LAYOUT], out, progress=False, judge=options))
    assert rows[0].s_consist == 21.0
    assert list(read_scores(out)) == rows
    count = len(loopback.requests)
    assert list(score_layouts(lambda: [LAYOUT], out, progress=False, judge=options)) == rows
    assert len(loopback.requests) == count
    with pytest.raises(OptionError):
        list(score_layouts(lambda: [LAYOUT], out, progress=False))
    assert all(KEY.encode() not in path.read_bytes() for path in out.rglob("*") if path.is_file())


def test_a_judgement_needs_a_sample():
    with pytest.raises(ValueError, match="at least 1"):
        Judgement(model="m", prompt="p/1", mode="medium", pictures=(), samples=())
