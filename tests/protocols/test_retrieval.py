"""Retrieval from the library: what is found, how it is scored, and what happens without embeddings."""

from __future__ import annotations

import json
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from labgym.assets import Catalog
from labgym.errors import OptionError
from labgym.protocols import protocols
from labgym.protocols.retrieval import Fragment, Index, corpus, fragments, index, search
from labgym.protocols.retrieval.index import EMBEDDING_WEIGHT
from labgym.protocols.retrieval.keywords import MAX_KEPT, KeywordTable

CATALOG = Catalog.load()
QUERIES = json.loads((Path(__file__).parent / "queries.json").read_text(encoding="utf-8"))
needs_embeddings = pytest.mark.skipif(find_spec("wordllama") is None, reason="extra embed is not installed")


def recall_at_5(split: str, keyword_only: bool) -> float:
    chosen = [item for item in QUERIES if item["split"] == split]
    shares = []
    for item in chosen:
        relevant = set(item["relevant"])
        found = {hit.fragment.source for hit in search(item["query"], keyword_only=keyword_only).hits}
        shares.append(len(found & relevant) / min(5, len(relevant)))
    return float(np.mean(shares))


def test_the_labelled_queries_are_of_both_languages_and_speak_of_the_library() -> None:
    assert len(QUERIES) >= 180
    assert sum(item["language"] == "zh" for item in QUERIES) >= 50
    assert sum(item["split"] == "held out" for item in QUERIES) >= len(QUERIES) // 3
    known = {fragment.source for fragment in corpus(CATALOG)}
    assert {name for item in QUERIES for name in item["relevant"]} <= known
    assert len({item["query"] for item in QUERIES}) == len(QUERIES)


@pytest.mark.cases(1)
@pytest.mark.parametrize("split", ["tuning", "held out"])
@needs_embeddings
def test_recall_of_hybrid_search(split: str) -> None:
    assert recall_at_5(split, keyword_only=False) >= 0.95


@pytest.mark.parametrize("split", ["tuning", "held out"])
def test_recall_of_keyword_search(split: str) -> None:
    assert recall_at_5(split, keyword_only=True) >= 0.85


def test_hits_name_their_source_and_carry_both_scores() -> None:
    results = search("用TBAF脱去TBS保护基")
    first = results.hits[0]
    assert first.fragment.source == "pro_05"
    assert len({hit.fragment.source for hit in results.hits}) == len(results.hits) == 5
    assert [hit.score for hit in results.hits] == sorted((hit.score for hit in results.hits), reverse=True)
    assert first.keyword > 0.0
    assert (first.similarity is None) == (results.method == "keyword")


def test_every_step_of_every_protocol_is_in_exactly_one_fragment() -> None:
    for protocol in protocols().values():
        covered = [
            index
            for fragment in fragments([protocol], CATALOG)
            if fragment.steps is not None
            for index in range(fragment.steps[0], fragment.steps[1] + 1)
        ]
        assert covered == [step.index for step in protocol.steps]


def test_the_words_of_a_step_find_that_step() -> None:
    asked, found = 0, 0
    for protocol in protocols().values():
        step = max(protocol.steps, key=lambda step: len(step.text))
        fragment = search(step.text).hits[0].fragment
        asked += 1
        if fragment.source == protocol.id and fragment.steps is not None:
            found += fragment.steps[0] <= step.index <= fragment.steps[1]
    assert found >= 0.9 * asked


def test_fusion_is_the_sum_of_reciprocal_ranks() -> None:
    pieces = [Fragment(name, "protocol", "card", name, text) for name, text in (("a", "acetone"), ("b", "toluene"))]

    def embedder(texts: list[str]) -> np.ndarray:
        return np.array([[1.0, 0.0] if "acetone" in text else [0.6, 0.8] for text in texts], dtype=np.float32)

    hits = Index(pieces, embedder).search("toluene").hits
    assert {hit.fragment.source: hit.score for hit in hits} == pytest.approx(
        {"b": (1 + EMBEDDING_WEIGHT) / 61, "a": EMBEDDING_WEIGHT / 62}
    )
    assert hits[0].similarity == pytest.approx(1.0)


def test_without_the_extra_search_is_by_keyword_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wordllama", None)
    index.load_embedder.cache_clear()
    try:
        results = search("Boc deprotection with TFA")
    finally:
        index.load_embedder.cache_clear()
    assert results.method == "keyword"
    assert "embed" in results.note
    assert results.hits[0].fragment.source == "pro_02"


@needs_embeddings
def test_embeddings_need_no_network_and_leave_logging_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    import logging
    import socket

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("network")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    before = list(logging.getLogger().handlers)
    vectors = index.WordLlamaEmbedder()(["reduce a ketone", "ketone reduction", "wash the glassware", ""])
    assert logging.getLogger().handlers == before
    assert np.linalg.norm(vectors[:3], axis=1) == pytest.approx(1.0, abs=1e-5)
    assert vectors[0] @ vectors[1] > vectors[0] @ vectors[2]
    assert not vectors[3].any()


@pytest.mark.parametrize("query", ["", "  ", "x" * 6000])
def test_an_empty_or_endless_query_is_refused(query: str) -> None:
    with pytest.raises(OptionError, match="query"):
        search(query)


def test_nothing_known_finds_nothing_by_keyword() -> None:
    assert search("qqqq zzzz", keyword_only=True).hits == ()


def test_a_kept_keyword_index_gives_the_same_answers_and_a_damaged_one_is_built_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pieces = corpus(CATALOG)[:60]
    queries = [item["query"] for item in QUERIES][:60]

    def answers(kept: Index) -> list[list[tuple[str, float]]]:
        return [[(hit.fragment.source, hit.keyword) for hit in kept.search(query).hits] for query in queries]

    expected = answers(Index(pieces, None, CATALOG))
    assert answers(Index(pieces, None, CATALOG, tmp_path)) == expected
    (file,) = tmp_path.iterdir()
    content = file.read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr(Index, "_terms", lambda _: pytest.fail("the index was built again"))
        assert answers(Index(pieces, None, CATALOG, tmp_path)) == expected
    middle = len(content) // 2
    for damaged in (b"", b"no archive", content[:middle], content[:middle] + b"????" + content[middle + 4 :]):
        file.write_bytes(damaged)
        assert answers(Index(pieces, None, CATALOG, tmp_path)) == expected
        assert file.read_bytes() == content
    Index(pieces[:-1], None, CATALOG, tmp_path)
    assert len(list(tmp_path.iterdir())) == 2


def test_a_folder_keeps_few_keyword_indexes_and_need_not_be_writable(tmp_path: Path) -> None:
    for number in range(MAX_KEPT + 3):
        KeywordTable.cached(tmp_path, f"{number}", lambda: [["acetone"], ["toluene", "acetone"]])
    assert len(list(tmp_path.iterdir())) == MAX_KEPT
    blocked = tmp_path / "file"
    blocked.write_text("no folder", encoding="utf-8")
    assert KeywordTable.cached(blocked, "key", lambda: [["acetone"], ["toluene"]]).scores(["toluene"])[1] > 0.0
