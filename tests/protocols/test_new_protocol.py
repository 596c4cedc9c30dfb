"""Free text to a protocol by a language model, from the description to the file: what is refused and what is kept."""

from __future__ import annotations

import json

import pytest

from labgym.cli import main
from labgym.protocols import Protocol, ProtocolError, get
from labgym.protocols.synthesis import RefusalError, synthesize
from labgym.protocols.synthesis.llm_writer import LanguageWriter

GIVEN = get("sub_01")
TEXT = "Make benzyl phenyl ether from phenol, benzyl bromide and K2CO3 in acetone under reflux"


def answer(**changes) -> str:
    data = GIVEN.to_json()
    kept = {key: data[key] for key in ("name", "reaction_type", "product", "description", "reagents", "instruments")}
    steps = [{key: value for key, value in step.items() if key != "index"} for step in data["steps"]]
    return json.dumps({"refusal": "", **kept, "steps": steps, **changes})


def test_faults_that_are_left_after_the_repairs_end_in_one_clear_error(loopback, model_at):
    loopback.says(answer(instruments=[*GIVEN.instruments, "Polarimeter"]))
    with pytest.raises(ProtocolError, match="Polarimeter"):
        synthesize(TEXT, LanguageWriter(model_at(), repairs=2), keyword_only=True)
    assert len(loopback.requests) == 3


def test_what_must_not_be_made_is_never_asked_for(loopback, model_at):
    loopback.says(answer())
    writer = LanguageWriter(model_at())
    for text in ("Make TNT from toluene", "Cuire des pâtes dans le potage", "Make me a coffee with phenylacetylene"):
        with pytest.raises(RefusalError):
            synthesize(text, writer, keyword_only=True)
    assert loopback.requests == []


def test_a_dangerous_product_under_another_request_is_refused(loopback, model_at):
    loopback.says(answer(name="Trinitrotoluene", product="TNT"))
    with pytest.raises(RefusalError, match="explosive"):
        synthesize(TEXT, LanguageWriter(model_at()), keyword_only=True)


def test_the_command_uses_the_model_of_the_environment(loopback, monkeypatch, tmp_path, capsys):
    loopback.says(answer())
    monkeypatch.setenv("LABGYM_LLM_BASE_URL", loopback.url)
    monkeypatch.setenv("LABGYM_LLM_MODEL", "loop")
    file = tmp_path / "p.json"
    assert main(["protocols", "new", TEXT, "--model", "--keyword-only", "--out", str(file)]) == 0
    assert "written by loop" in capsys.readouterr().err
    assert Protocol.load(file).reagents == GIVEN.reagents


def test_without_a_configured_model_the_command_says_what_is_missing(monkeypatch, tmp_path, capsys):
    monkeypatch.delenv("LABGYM_LLM_BASE_URL", raising=False)
    assert main(["protocols", "new", TEXT, "--model", "--out", str(tmp_path / "p.json")]) == 2
    assert "LABGYM_LLM_BASE_URL" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
