"""The process that reads one USD file: bounded in memory and time, silent, its answer on standard output.

USD's reader is a large C++ library; a file that makes it hang, crash or ask for all memory ends only this process.
"""

from __future__ import annotations

import io
import json
import os
import resource
import sys
from pathlib import Path

import numpy as np

from labgym.assets.meshes.model import Limits, MeshError, RawMesh
from labgym.assets.meshes.stage import read_stage


def pack(raw: RawMesh) -> bytes:
    """Return a mesh as an npz archive."""
    arrays = {f"{kind}{k}": getattr(part, kind) for k, part in enumerate(raw.parts) for kind in ("vertices", "faces")}
    parts = [{"name": part.name, "color": part.color, "material": part.material} for part in raw.parts]
    head = {"parts": parts, "name": raw.name, "unit": raw.unit, "up_axis": raw.up_axis, "metadata": raw.metadata}
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, head=np.array(json.dumps(head)), **arrays)
    return stream.getvalue()


def main() -> None:
    """Read the file named by the first argument within the limits of the second, a JSON object."""
    answer = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    # Output of C++ libraries, on either stream, does not belong to the answer.
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    limits = Limits(**json.loads(sys.argv[2]))
    resource.setrlimit(resource.RLIMIT_AS, (limits.memory, limits.memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        content = pack(read_stage(Path(sys.argv[1]), limits))
    except MeshError as error:
        content = json.dumps({"error": error.problem}).encode()
    with os.fdopen(answer, "wb") as stream:
        stream.write(content)


if __name__ == "__main__":
    main()
