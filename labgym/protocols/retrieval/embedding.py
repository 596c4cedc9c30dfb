"""Sentence embeddings that come in a wheel and need no network."""

from __future__ import annotations

import logging
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

Vectors = np.ndarray[Any, np.dtype[np.float32]]


class Embedder(Protocol):
    """Anything that places texts in a space where what means the same is near."""

    def __call__(self, texts: list[str]) -> Vectors:
        """Return unit vectors, shape (texts, dimensions)."""
        ...


class WordLlamaEmbedder:
    """Averaged token embeddings of wordllama, 256 dimensions, from the files in its wheel; English only.

    Raises:
        ImportError: wordllama is not installed.
    """

    def __init__(self) -> None:
        root = logging.getLogger()
        handlers, level = list(root.handlers), root.level
        import wordllama

        # The package sets up logging for the whole process when it is imported; that is for the caller to do.
        root.handlers[:], root.level = handlers, level
        folder = Path(wordllama.__file__).parent
        # Its own search for the tokenizer looks beside the folder that the wheel has; as a cache the folder is found.
        self._model = wordllama.WordLlama.load(cache_dir=folder, disable_download=True)

    def __call__(self, texts: list[str]) -> Vectors:
        """Return unit vectors, shape (texts, 256); zeros for a text without tokens."""
        vectors: Vectors = np.asarray(self._model.embed(texts), dtype=np.float32)
        norms = np.linalg.norm(vectors, axis=1, keepdims=True)
        vectors /= np.where(norms > 0.0, norms, 1.0)
        return vectors


@lru_cache(maxsize=1)
def load_embedder() -> Embedder | None:
    """Return the embedder, or None where the extra `embed` is not installed."""
    try:
        return WordLlamaEmbedder()
    except ImportError:
        return None
