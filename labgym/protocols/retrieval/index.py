"""Hybrid search: BM25 over terms and cosine over embeddings, fused by reciprocal rank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from labgym.assets import Catalog
from labgym.errors import OptionError
from labgym.protocols.retrieval.corpus import Fragment, SourceKind, corpus
from labgym.protocols.retrieval.embedding import Embedder, load_embedder
from labgym.protocols.retrieval.tokens import english, terms

RANK_CONSTANT = 60.0
"""k of reciprocal-rank fusion: score = sum over lists of 1 / (k + rank)."""
EMBEDDING_WEIGHT = 0.25
"""Weight of the embeddings' ranking in the fusion; the keywords' is 1. Averaged word vectors ignore word order, so they
separate two hundred experiments that share their words less well. Chosen on the tuning queries alone."""
DEPTH = 100
"""Number of fragments of each ranking that take part in the fusion."""
MAX_QUERY = 5000
COUNT = 5


@dataclass(frozen=True)
class Hit:
    """A fragment that matches a query.

    Attributes:
        score: score of the fusion, comparable within one search only.
        keyword: BM25 score.
        similarity: cosine of the embeddings, or None without embeddings.
    """

    fragment: Fragment
    score: float
    keyword: float
    similarity: float | None


@dataclass(frozen=True)
class SearchResults:
    """Hits of a search, best first, and the method that ranked them.

    Attributes:
        note: reason why embeddings were not used, or "".
    """

    query: str
    hits: tuple[Hit, ...]
    method: Literal["hybrid", "keyword"]
    note: str


class Index:
    """A searchable index over fragments; it depends on the fragments and the catalog only.

    Args:
        fragments: what is searched, at least one.
        embedder: function that embeds texts, or None for keyword search.
        catalog: the assets whose names are recognized; the default catalog if None.

    Raises:
        OptionError: no fragments.
    """

    def __init__(
        self, fragments: Sequence[Fragment], embedder: Embedder | None, catalog: Catalog | None = None
    ) -> None:
        import bm25s

        if not fragments:
            raise OptionError("an index needs at least one fragment, got none")
        self.fragments = tuple(fragments)
        self._catalog = catalog if catalog is not None else Catalog.load()
        self._embedder = embedder
        self._keywords = bm25s.BM25()
        self._keywords.index([terms(fragment.text, self._catalog) for fragment in fragments], show_progress=False)
        self._vectors = (
            None if embedder is None else embedder([english(fragment.text, self._catalog) for fragment in fragments])
        )

    def search(
        self, query: str, count: int = COUNT, keyword_only: bool = False, origin: SourceKind | None = None
    ) -> SearchResults:
        """Return the nearest fragments, at most one per source.

        Args:
            query: text in English or Chinese, at most 5000 characters.
            count: largest number of hits.
            keyword_only: ignore the embeddings.
            origin: kind of source to search; all kinds if None.

        Raises:
            OptionError: an empty or too long query, or a count below 1.
        """
        if not query.strip() or len(query) > MAX_QUERY or count < 1:
            raise OptionError(f"a query needs 1 to {MAX_QUERY} characters and a count of 1 or more")
        query = query.encode("utf-8", "replace").decode("utf-8")
        keyword = self._keyword_scores(query)
        ranked = [(_ranking(keyword, positive=True), 1.0)]
        similarity = None
        if self._vectors is not None and self._embedder is not None and not keyword_only:
            similarity = self._vectors @ self._embedder([english(query, self._catalog)])[0]
            ranked.append((_ranking(similarity), EMBEDDING_WEIGHT))
        fused = np.zeros(len(self.fragments))
        for order, weight in ranked:
            fused[order] += weight / (RANK_CONSTANT + np.arange(1, len(order) + 1))
        hits = self._best_by_source(fused, keyword, similarity, count, origin)
        return SearchResults(query, hits, "keyword" if similarity is None else "hybrid", self._note(keyword_only))

    def _keyword_scores(self, query: str) -> np.ndarray[Any, Any]:
        indexed = [term for term in terms(query, self._catalog) if term in self._keywords.vocab_dict]
        if not indexed:
            return np.zeros(len(self.fragments))
        return np.asarray(self._keywords.get_scores(indexed), dtype=float)

    def _best_by_source(
        self,
        fused: np.ndarray[Any, Any],
        keyword: np.ndarray[Any, Any],
        similarity: np.ndarray[Any, Any] | None,
        count: int,
        origin: SourceKind | None,
    ) -> tuple[Hit, ...]:
        hits: dict[str, Hit] = {}
        for position in np.argsort(-fused, kind="stable"):
            fragment = self.fragments[position]
            if len(hits) == count or fused[position] <= 0.0:
                break
            if origin not in (None, fragment.origin):
                continue
            near = None if similarity is None else float(similarity[position])
            hits.setdefault(fragment.source, Hit(fragment, float(fused[position]), float(keyword[position]), near))
        return tuple(hits.values())

    def _note(self, keyword_only: bool) -> str:
        if keyword_only:
            return "keywords only, as requested"
        return "" if self._embedder is not None else "keywords only: no embeddings without the extra 'embed'"


def search(
    query: str,
    count: int = COUNT,
    keyword_only: bool = False,
    origin: SourceKind | None = None,
    catalog: Catalog | None = None,
) -> SearchResults:
    """Search the published library; see `Index.search`. The index is built once per process and catalog.

    Args:
        catalog: the assets whose names are recognized; the default catalog if None.
    """
    index = _published(
        catalog if catalog is not None else Catalog.load(), load_embedder() is not None and not keyword_only
    )
    return index.search(query, count, keyword_only, origin)


@lru_cache(maxsize=4)
def _published(catalog: Catalog, embedded: bool) -> Index:
    return Index(corpus(catalog), load_embedder() if embedded else None, catalog)


def _ranking(scores: np.ndarray[Any, Any], positive: bool = False) -> np.ndarray[Any, Any]:
    """Return the positions of the best scores, best first; ties keep the order of the fragments."""
    order = np.argsort(-scores, kind="stable")[:DEPTH]
    return order[scores[order] > 0.0] if positive else order
