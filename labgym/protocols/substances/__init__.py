"""Open substances: what names outside the catalog mean, from a published table, databases, a parser and the record."""

from labgym.protocols.substances.opening import Opened, Resolution, Resolver, opened

__all__ = ["Opened", "Resolution", "Resolver", "opened"]
