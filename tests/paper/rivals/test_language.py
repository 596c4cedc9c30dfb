"""Rivals with a language model, over a loopback connection: its answer is used, and nonsense still gives a layout."""

import base64
import io
import json
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from labgym.layouts.generate import resolve_request
from labgym.layouts.method import make_proposer, proposer_names
from labgym.layouts.placement import FLOOR
from labgym.llm import LanguageModelError
from labgym.paper.rivals.chamber import chambers
from labgym.paper.rivals.language import (
    HolodeckLanguageProposer,
    HolodeckPlusLanguageProposer,
    SceneWeaverLanguageProposer,
)
from labgym.paper.rivals.language.proposers import ModelPlanner, PictureGuide
from labgym.paper.rivals.piece import RivalPiece
from labgym.paper.rivals.sceneweaver.critic import Critique, SceneProblem
from labgym.paper.rivals.sceneweaver.policy import WeaverAction
from labgym.paper.rivals.sceneweaver.scene import WeaverItem, WeaverScene
from labgym.paper.rivals.sceneweaver.tools import Toolbox


def listed(name: str, quantity: int = 1, place: str = "edge", **fields: Any) -> dict[str, Any]:
    defaults = {"location": "floor", "height": 0.0, "relations": [], "on_top": []}
    return {"name": name, "quantity": quantity, "place": place, **defaults, **fields}


ROOM = [
    listed("lab bench", 2, on_top=[{"name": "Erlenmeyer flask", "quantity": 3}, {"name": "acetone", "quantity": 1}]),
    listed("fume hood", relations=[{"relation": "far", "target": "lab bench"}]),
    listed("lab stool", 2, "middle", relations=[{"relation": "around", "target": "lab bench"}]),
    listed("clock", location="wall", height=2.0),
    listed("grand piano", relations=[{"relation": "near", "target": "violin"}]),
]


@pytest.fixture
def request_():
    return resolve_request("sub_01", 1, None, "default", None, ())


def test_holodeck_places_what_the_model_lists(loopback, model_at, request_):
    loopback.says(json.dumps({"objects": ROOM}))
    model = model_at()
    layout = HolodeckLanguageProposer(model).propose(request_)
    counts: dict[str, int] = {}
    for placement in layout.placements:
        counts[placement.asset] = counts.get(placement.asset, 0) + 1
    assert counts == {"LabBench": 2, "FumeHood": 1, "LabStool": 2, "ErlenmeyerFlask": 6, "Acetone": 2, "Clock": 1}
    assert layout.provenance.options["designer"] == model.config.model
    question = loopback.requests[0]["messages"][1]["content"]
    assert "Williamson" in str(question)
    assert "MeltingPointApparatus" not in str(question)  # a description, no lists


def test_holodeck_plus_gives_the_model_the_lists_of_the_protocol(loopback, model_at, request_):
    loopback.says(json.dumps({"objects": ROOM[:1]}))
    HolodeckPlusLanguageProposer(model_at()).propose(request_)
    assert "MeltingPointApparatus" in str(loopback.requests[0]["messages"][1]["content"])


def test_sceneweaver_takes_the_steps_that_the_model_chooses(loopback, model_at, request_):
    loopback.says(json.dumps({"objects": ROOM[:2]}))
    loopback.says(json.dumps({"stop": False, "problem": 0, "tool": "add"}))
    loopback.says(json.dumps({"stop": True, "problem": 0, "tool": "add"}))
    layout = SceneWeaverLanguageProposer(model_at()).propose(request_)
    # The first problem is that something critical is missing: one step adds five of these things.
    assert layout.provenance.options["steps"] == 2
    present = {placement.asset for placement in layout.placements}
    assert {"LabBench", "FumeHood", "GeneralCabinet", "SinkBench", "LabStool"} <= present
    assert len(loopback.requests) == 3


NONSENSE = [
    {"objects": []},
    {"objects": [listed("Schrödinger's cat", 10), listed("lab door"), listed("acetone", 3), listed("clock")]},
    {"objects": [listed("island bench", 10, "middle", on_top=[{"name": "fume hood", "quantity": 5}])]},
]


@pytest.mark.parametrize("answer", NONSENSE, ids=["empty", "unknown", "too large"])
@pytest.mark.parametrize("proposer", [HolodeckLanguageProposer, SceneWeaverLanguageProposer])
def test_nonsense_that_fits_the_form_gives_a_layout(loopback, model_at, request_, proposer, answer):
    loopback.says(json.dumps(answer))
    loopback.says(json.dumps({"stop": False, "problem": 999, "tool": "rotate"}))
    layout = proposer(model_at()).propose(request_)
    layout.check_references()
    assert all(placement.asset == "IslandBench" for placement in layout.placements if placement.support == FLOOR)


def test_a_tool_that_does_not_fit_is_replaced(loopback, model_at, request_):
    loopback.says(json.dumps({"objects": ROOM[:1]}))
    loopback.says(json.dumps({"stop": False, "problem": 0, "tool": "rotate"}))
    loopback.says(json.dumps({"stop": True, "problem": 0, "tool": "add"}))
    layout = SceneWeaverLanguageProposer(model_at()).propose(request_)
    assert "FumeHood" in {placement.asset for placement in layout.placements}


def test_a_reply_that_is_not_of_the_form_is_an_error(loopback, model_at, request_):
    loopback.says("I would rather not.")
    with pytest.raises(LanguageModelError):
        HolodeckLanguageProposer(model_at()).propose(request_)


def test_the_request_decides_the_random_seed_and_a_wrong_form_goes_back(loopback, model_at, request_):
    loopback.says("not JSON")
    loopback.says(json.dumps({"objects": ROOM}))
    layout = HolodeckLanguageProposer(model_at()).propose(request_)
    assert [sent["seed"] for sent in loopback.requests] == [1, 1]
    assert layout.placements


def test_both_spellings_of_holodeck_plus_name_the_same_proposer(request_):
    spellings = [make_proposer(name) for name in ("holodeck+-llm", "holodeck-plus-llm")]
    assert spellings[0] == spellings[1]
    assert isinstance(spellings[0], HolodeckPlusLanguageProposer)
    assert "holodeck-plus-llm" not in proposer_names()


def test_sceneweaver_shows_a_model_that_sees_a_picture_of_a_bare_bench(loopback, model_at, request_):
    chamber, model = chambers(request_)[0], model_at()
    bench = RivalPiece("LabBench_1", request_.catalog.get("LabBench"), 2.5, 2.0, 0.0)
    scene, guide = WeaverScene((WeaverItem(bench),)), PictureGuide(model, request_, chamber)
    tops = [
        {"name": "beaker", "quantity": 2},
        {"name": "fume hood", "quantity": 1},
        {"name": "elephant", "quantity": 5},
    ]
    loopback.says(json.dumps({"objects": tops}))
    toolbox = Toolbox(request_, chamber, np.random.default_rng(0), Counter({"LabBench": 1}), guide)
    problem = SceneProblem("layout", "bare", bench.id)
    filled = toolbox.act(scene, WeaverAction(problem, "picture"), Critique(0, {}, (problem,)))
    assert [top.asset.name for top in filled.on(bench.id)] == ["Beaker", "Beaker"]
    picture = loopback.requests[0]["messages"][1]["content"][1]["image_url"]["url"]
    image = Image.open(io.BytesIO(base64.b64decode(picture.partition(",")[2])))
    assert len(image.getcolors(image.width * image.height)) > 100
    assert replace(toolbox, guide=None).act(scene, WeaverAction(problem, "picture"), Critique(0, {}, ())) is scene


@pytest.mark.parametrize("sees", [False, True])
def test_the_tool_picture_is_there_for_a_model_that_sees(loopback, model_at, sees):
    bare = SceneProblem("layout", "bare", "LabBench_1")
    loopback.says(json.dumps({"stop": False, "problem": 0, "tool": "picture"}))
    action = ModelPlanner(model_at(), "a laboratory", sees=sees).choose(Critique(0, {}, (bare,)))
    assert action is not None
    assert (action.tool == "picture") == sees
    assert ("picture" in str(loopback.requests[0]["messages"][1]["content"])) == sees
