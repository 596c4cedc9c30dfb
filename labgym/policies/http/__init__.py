"""Policies over HTTP, by the protocol of the NavDP benchmark: drive its servers, and serve ours to its clients."""
