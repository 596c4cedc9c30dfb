"""Hybrid search: BM25 over terms and cosine over embeddings, fused by reciprocal rank.

The embeddings come from a wheel, without network access.
"""

from __future__ import annotations

import logging
import platform
import re
import typing
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from labgym.artefacts import artefacts, user_cache
from labgym.assets import Catalog
from labgym.assets.search import surface_forms
from labgym.documents import canonical_hash, files_digest
from labgym.errors import OptionError
from labgym.protocols.language import concepts, gloss, mentions, without_chinese_names
from labgym.protocols.language.concepts import word_table
from labgym.protocols.retrieval.corpus import Fragment, SourceKind, corpus
from labgym.protocols.retrieval.keywords import KeywordTable

Vectors = np.ndarray[Any, np.dtype[np.float32]]
_WORD = re.compile(r"[a-z][a-z]+|\d+(?:\.\d+)?")
_HAN = re.compile(r"[\u3400-\u9fff]+")
_ENDINGS = ("ations", "ation", "ising", "izing", "ised", "ized", "ingly", "ings", "ing", "ions", "ion", "ies", "ied")
_SHORT_ENDINGS = ("ise", "ize", "ed", "es", "er", "ly", "al", "ic", "e", "s", "y")
MIN_STEM = 4
NAME_WORDS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
RANK_CONSTANT = 60.0
"""k of reciprocal-rank fusion: score = sum over lists of 1 / (k + rank)."""
EMBEDDING_WEIGHT = 0.25
"""Weight of the embeddings' ranking in the fusion; the keywords' is 1. Averaged word vectors ignore word order, so they
separate two hundred experiments that share their words less well. Chosen on the tuning queries alone."""
DEPTH = 100
"""Number of fragments of each ranking that take part in the fusion."""
MAX_QUERY = 5000
COUNT = 5


class Embedder(typing.Protocol):
    """A function that maps texts to vectors so that similar meanings are close."""

    def __call__(self, texts: list[str]) -> Vectors:
        """Return unit vectors, shape (texts, dimensions)."""
        ...


class WordLlamaEmbedder:
    """Averaged token embeddings of wordllama, 256 dimensions, read from its wheel; English only.

    Raises:
        ImportError: wordllama is not installed.
    """

    def __init__(self) -> None:
        root = logging.getLogger()
        handlers, level = list(root.handlers), root.level
        import wordllama

        # Importing the package configures logging for the whole process; that is up to the caller, so undo it.
        root.handlers[:], root.level = handlers, level
        folder = Path(wordllama.__file__).parent
        # The package looks for the tokenizer in the wrong folder; with the wheel's folder as its cache it finds it.
        self._model = wordllama.WordLlama.load(cache_dir=folder, disable_download=True)

    def __call__(self, texts: list[str]) -> Vectors:
        """Return unit vectors, shape (texts, 256); zeros for a text without tokens."""
        vectors: Vectors = np.asarray(self._model.embed(texts), dtype=np.float32)
        norms = np.linalg.norm(vectors, axis=1, keepdims=True)
        vectors /= np.where(norms > 0.0, norms, 1.0)
        return vectors


@lru_cache(maxsize=1)
def load_embedder() -> Embedder | None:
    """Return the embedder, or None if the extra `embed` is not installed."""
    try:
        return WordLlamaEmbedder()
    except ImportError:
        return None


def terms(text: str, catalog: Catalog) -> list[str]:
    """Return the search terms of a text, including repeats.

    Assets become their canonical names, so that "DCM" matches 二氯甲烷; operations and transformations become the names
    of concepts, so that "rotovap" matches "evaporate".
    """
    named = mentions(text, catalog)
    rest, last = [], 0
    for mention in named:
        rest.append(text[last : mention.start])
        last = mention.end
    plain = " ".join([*rest, text[last:]]).lower()
    return [
        *(f"asset:{mention.name}" for mention in named if mention.kind != "class"),
        *(f"concept:{name}" for name in concepts(without_chinese_names(text, catalog))),
        *(stem(word) for word in _WORD.findall(text.lower()) if word not in word_table().english_words),
        *(run[i : i + 2] for run in _HAN.findall(plain) for i in range(max(len(run) - 1, 1))),
    ]


def english(text: str, catalog: Catalog) -> str:
    """Return a text for an English embedding model: names of assets spelled out, Chinese technical terms translated."""
    pieces, last = [], 0
    for mention in mentions(text, catalog):
        pieces += [gloss(text[last : mention.start]), _spelt(mention.name)]
        last = mention.end
    pieces.append(gloss(text[last:]))
    return " ".join(" ".join(pieces).split())


def stem(word: str) -> str:
    """Return an English word without its most common endings; queries and fragments are stemmed alike."""
    for endings in (_ENDINGS, _SHORT_ENDINGS):
        for ending in endings:
            if word.endswith(ending) and len(word) - len(ending) >= MIN_STEM:
                return word.removesuffix(ending)
    return word


def _spelt(name: str) -> str:
    return " ".join(NAME_WORDS.findall(name)).lower() if name[:1].isupper() and " " not in name else name


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
        folder: folder that keeps the keyword index from process to process; None keeps none.

    Raises:
        OptionError: no fragments.
    """

    def __init__(
        self,
        fragments: Sequence[Fragment],
        embedder: Embedder | None,
        catalog: Catalog | None = None,
        folder: Path | None = None,
    ) -> None:
        if not fragments:
            raise OptionError("an index needs at least one fragment, got none")
        self.fragments = tuple(fragments)
        self._catalog = catalog if catalog is not None else Catalog.load()
        self._embedder = embedder
        self._keywords = (
            KeywordTable(self._terms()) if folder is None else KeywordTable.cached(folder, self._key(), self._terms)
        )
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
        keyword = self._keywords.scores(terms(query, self._catalog))
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

    def _terms(self) -> list[list[str]]:
        return [terms(fragment.text, self._catalog) for fragment in self.fragments]

    def _key(self) -> str:
        """Digest of everything that the keyword index depends on: texts, assets, words, and the code."""
        package = Path(__file__).parent.parent
        sources = [file for name in ("retrieval", "language") for file in sorted((package / name).glob("*.py"))]
        sources += [package.parent / "assets" / "search.py"]
        words = sorted((artefacts("assets") / "language").glob("*.json"))
        return canonical_hash(
            {
                "texts": [fragment.text for fragment in self.fragments],
                "assets": [
                    (a.kind, a.core, a.synonyms_en, a.synonyms_zh, surface_forms(a)) for a in self._catalog.assets
                ],
                "files": files_digest([*sources, *words]),
                "versions": [platform.python_version(), version("bm25s"), version("numpy")],
            }
        )

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
        catalog if catalog is not None else Catalog.load(), not keyword_only and load_embedder() is not None
    )
    return index.search(query, count, keyword_only, origin)


@lru_cache(maxsize=4)
def _published(catalog: Catalog, embedded: bool) -> Index:
    return Index(corpus(catalog), load_embedder() if embedded else None, catalog, user_cache() / "search")


def _ranking(scores: np.ndarray[Any, Any], positive: bool = False) -> np.ndarray[Any, Any]:
    """Return the positions of the best scores, best first; ties keep the order of the fragments."""
    order = np.argsort(-scores, kind="stable")[:DEPTH]
    return order[scores[order] > 0.0] if positive else order
