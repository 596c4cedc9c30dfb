"""The process that decomposes one mesh with coacd: bounded in memory and processor time, silent.

It reads an npz archive of parts on standard input and writes one of the pieces' vertices to standard output. A mesh
that makes coacd hang, crash or ask for all memory ends this process only.
"""

from __future__ import annotations

import io
import os
import resource
import sys

import numpy as np

_OPTIONS = {
    "threshold": 0.05,
    "resolution": 500,
    "mcts_nodes": 10,
    "mcts_iterations": 60,
    "mcts_max_depth": 2,
    "seed": 0,
}
"""A search of two seconds per part; coacd's defaults take eight times as long, and the bodies fit no better."""


def main() -> None:
    """Decompose the parts on standard input: arguments are parts, pieces per part, processor seconds and bytes."""
    count, most, seconds, memory = (int(argument) for argument in sys.argv[1:5])
    answer = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # C++ prints on both streams
    os.dup2(nowhere, 2)
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    import coacd
    import trimesh

    coacd.set_log_level("error")
    pieces: dict[str, np.ndarray] = {}
    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as arrays:
        for k in range(count):
            mesh = trimesh.Trimesh(arrays[f"vertices{k}"], arrays[f"faces{k}"])
            whole = coacd.Mesh(np.array(mesh.vertices), np.array(mesh.faces))
            bodies = coacd.run_coacd(whole, max_convex_hull=most, **_OPTIONS)[:most] if len(mesh.faces) else []
            pieces[f"count{k}"] = np.array(len(bodies))
            pieces |= {f"{k}_{j}": np.asarray(vertices, np.float64) for j, (vertices, _) in enumerate(bodies)}
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **pieces)
    with os.fdopen(answer, "wb") as output:
        output.write(stream.getvalue())


if __name__ == "__main__":
    main()
