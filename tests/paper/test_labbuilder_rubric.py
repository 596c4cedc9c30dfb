"""The rubric of LabBuilder's authors over a real connection: four dimensions, caps at 5, the mode in the question."""

from __future__ import annotations

import json

import pytest

from labgym.eval.scoring import judge
from labgym.paper.labbuilder_rules.rubric import CAPS

SCORES = {"realism": 9.0, "functionality": 8.0, "layout": 4.0, "completion": 7.0}


@pytest.fixture
def answers(loopback, monkeypatch):
    for name, value in {"WIDTH": 32, "HEIGHT": 18, "SAMPLES": 1}.items():
        monkeypatch.setattr(judge, name, value)
    monkeypatch.setenv("LABGYM_LLM_BASE_URL", loopback.url)
    monkeypatch.setenv("LABGYM_LLM_MODEL", "test-model")
    scores = {name: {"score": points, "reason": "as seen"} for name, points in SCORES.items()}
    loopback.says(json.dumps(scores | {"caps": [CAPS["functionality"], CAPS["layout"]]}))
    return loopback


def test_caps_lower_scores_to_5_and_the_mean_is_a_quarter_of_the_sum(answers, call):
    code, out, _ = call("score", "test-sub_02", "--rules", "labbuilder", "--judge", "strict")
    assert code == 0
    assert json.loads(out) == {
        "layout": "test-sub_02",
        "mode": "strict",
        "points": {"realism": 9.0, "functionality": 5.0, "layout": 4.0, "completion": 7.0, "mean": 6.25},
    }
    (request,) = answers.requests
    assert request["temperature"] == 0.3
    parts = request["messages"][1]["content"]
    assert '"strict"' in parts[0]["text"]
    assert sum(part["type"] == "image_url" for part in parts) > 1


def test_the_library_has_no_effect_on_the_rubric(answers, call):
    code, _, err = call("score", "test-sub_02", "--rules", "labbuilder", "--judge", "medium", "--library", "catalog")
    assert code == 2
    assert "--library has no effect with --rules labbuilder --judge" in err
    assert not answers.requests
