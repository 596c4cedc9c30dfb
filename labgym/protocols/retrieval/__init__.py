"""Retrieval: the fragments of the library that are nearest to a text in English or Chinese."""

from labgym.protocols.retrieval.corpus import Fragment, corpus, fragments
from labgym.protocols.retrieval.index import Index, SearchResults, search

__all__ = ["Fragment", "Index", "SearchResults", "corpus", "fragments", "search"]
