"""Run the host of policies: `python -m labgym.policies.process DESCRIPTOR` serves the evaluator on that socket."""

from __future__ import annotations

import socket
import sys

from labgym.policies.process.host import serve_host

if __name__ == "__main__":
    serve_host(socket.socket(fileno=int(sys.argv[1])))
