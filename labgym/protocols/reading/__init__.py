"""Reading of procedures: a text becomes a list of actions, each with the span that it comes from."""

from labgym.protocols.reading.actions import ActionList, Outcome, Unread

__all__ = ["ActionList", "Outcome", "Unread"]
