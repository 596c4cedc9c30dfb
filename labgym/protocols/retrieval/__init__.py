"""Retrieval: the fragments of the library that a description in English or Chinese is nearest to."""

from labgym.protocols.retrieval.corpus import Fragment, corpus, fragments
from labgym.protocols.retrieval.embedding import Embedder, load_embedder
from labgym.protocols.retrieval.index import Hit, Index, Results, search

__all__ = ["Embedder", "Fragment", "Hit", "Index", "Results", "corpus", "fragments", "load_embedder", "search"]
