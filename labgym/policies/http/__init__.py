"""Policies over HTTP with the NavDP benchmark's protocol: a client for its servers and a server for its clients."""
