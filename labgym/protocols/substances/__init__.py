"""Open substances: what names outside the catalog mean, from a published table, databases, a parser and the record."""

from labgym.protocols.substances.opening import OpenedExperiment, Resolver, opened

__all__ = ["OpenedExperiment", "Resolver", "opened"]
