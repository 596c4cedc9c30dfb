"""Run the host of policies: `python -P FILE DESCRIPTOR PLACE...` serves the evaluator on that socket.

The host runs no code of a policy, but a policy's folder may be on the evaluator's Python path, and hold modules with
the names of others. So it takes labgym from this file's folder, everything else from the interpreter's packages, and
what these lack from the places of the evaluator's packages.
"""

from __future__ import annotations

import socket
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path


def import_labgym(package: Path) -> None:
    """Import labgym from a folder that is not on the Python path."""
    spec = spec_from_file_location("labgym", package / "__init__.py", submodule_search_locations=[str(package)])
    assert spec is not None
    assert spec.loader is not None
    sys.modules["labgym"] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules["labgym"])


if __name__ == "__main__":
    descriptor, *places = sys.argv[1:]
    sys.path += places
    import_labgym(Path(__file__).resolve().parents[2])
    from labgym.policies.process.host import serve_host

    serve_host(socket.socket(fileno=int(descriptor)))
