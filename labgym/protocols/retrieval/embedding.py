"""Sentence embeddings from a wheel, without network access."""

from __future__ import annotations

import logging
import typing
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

Vectors = np.ndarray[Any, np.dtype[np.float32]]


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
