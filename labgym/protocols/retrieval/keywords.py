"""BM25 over search terms, kept in the user's cache from process to process."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from labgym.documents import write_bytes

MAX_KEPT = 8
"""Tables that a folder keeps; the oldest of more are removed."""
ARRAYS = ("data", "indices", "indptr")


class KeywordTable:
    """BM25 scores of texts by their terms.

    Args:
        tokens: terms of each text.
    """

    def __init__(self, tokens: Sequence[list[str]]) -> None:
        import bm25s

        self._model = bm25s.BM25()
        self._model.index(tokens, show_progress=False)

    @classmethod
    def cached(cls, folder: Path, key: str, tokens: Callable[[], Sequence[list[str]]]) -> KeywordTable:
        """Return the table that a folder keeps under a key; build and keep it if it is missing or damaged.

        Args:
            key: digest of everything that the terms depend on.
            tokens: returns the terms of each text.
        """
        path = folder / f"keywords-{key}.npz"
        with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return cls._read(path.read_bytes())
        table = cls(tokens())
        with suppress(OSError):  # A cache that cannot be written costs time only.
            write_bytes(path, table._bytes())
            kept = sorted(folder.glob("keywords-*.npz"), key=lambda file: file.stat().st_mtime_ns, reverse=True)
            for file in kept[MAX_KEPT:]:
                file.unlink(missing_ok=True)
        return table

    def scores(self, terms: Sequence[str]) -> np.ndarray[Any, Any]:
        """Return the BM25 score of each text, (texts,), for a query's terms."""
        indexed = [term for term in terms if term in self._model.vocab_dict]
        if not indexed:
            return np.zeros(self._model.scores["num_docs"])
        return np.asarray(self._model.get_scores(indexed), dtype=float)

    def _bytes(self) -> bytes:
        stream, scores = io.BytesIO(), self._model.scores
        rest = json.dumps({"texts": int(scores["num_docs"]), "vocabulary": self._model.vocab_dict})
        arrays = {name: scores[name] for name in ARRAYS}
        np.savez(stream, rest=np.frombuffer(rest.encode(), dtype=np.uint8), **arrays)
        return stream.getvalue()

    @classmethod
    def _read(cls, content: bytes) -> KeywordTable:
        """Return the table of a file.

        Raises:
            ValueError, KeyError, EOFError, BadZipFile: the file is damaged.
        """
        import bm25s

        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name] for name in ARRAYS}
            rest = json.loads(file["rest"].tobytes())
        table = cls.__new__(cls)
        table._model = bm25s.BM25()
        table._model.scores = {**arrays, "num_docs": rest["texts"]}
        table._model.vocab_dict = rest["vocabulary"]
        table._model.unique_token_ids_set = set(rest["vocabulary"].values())
        table._model.nonoccurrence_array = None
        return table
