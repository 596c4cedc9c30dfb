"""Retrieval: the fragments of the library that are nearest to a text in English or Chinese."""

from labgym.protocols.retrieval.corpus import Fragment, corpus, fragments
from labgym.protocols.retrieval.index import Embedder, Hit, Index, SearchResults, load_embedder, search

__all__ = ["Embedder", "Fragment", "Hit", "Index", "SearchResults", "corpus", "fragments", "load_embedder", "search"]
