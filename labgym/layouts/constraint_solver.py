"""Runs constraint programs over centimeters: deterministic, and interrupted by signals."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from ortools.sat.python import cp_model

CM = 100
SIGNAL_INTERVAL = 0.2
"""Seconds after which a pending signal interrupts a search at the latest."""
Status = Literal["solved", "infeasible", "stopped"]
"""Result of a search: `infeasible` is proved; `stopped` is the effort limit, without a solution and without a proof."""


def centimeters(meters: float) -> int:
    """Return a length in whole centimeters, rounded up."""
    return math.ceil(meters * CM - 1e-6)


def run(model: cp_model.CpModel, seed: int, effort: float, gap_limit: float) -> tuple[Status, cp_model.CpSolver]:
    """Search a solution of a program with one worker, and return the status and the solver with the solution.

    Args:
        seed: random seed of the search.
        effort: deterministic search time, in the solver's units (about seconds).
        gap_limit: relative distance to the best known bound at which the search stops.
    """
    from ortools.sat.python import cp_model

    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = seed % (2**31)
    solver.parameters.max_deterministic_time = effort
    solver.parameters.relative_gap_limit = gap_limit
    status = search(solver, model)
    if status == cp_model.UNKNOWN:
        return "stopped", solver
    return ("solved" if status in (cp_model.OPTIMAL, cp_model.FEASIBLE) else "infeasible"), solver


def search(solver: cp_model.CpSolver, model: cp_model.CpModel) -> cp_model.CpSolverStatus:
    """Run a solver and return its status. Ctrl-C and other signals stop it and reach the caller as exceptions.

    By itself the solver would end at Ctrl-C as at its effort limit, and a layout would depend on the interruption. It
    runs in a thread, because Python handles signals in the main thread only between two Python instructions.
    """
    solver.parameters.catch_sigint_signal = False
    with ThreadPoolExecutor(1) as thread:
        status = thread.submit(solver.solve, model)
        try:
            # With a time limit: a signal that another thread receives does not wake one that waits without.
            while not wait([status], timeout=SIGNAL_INTERVAL).done:
                pass
            return status.result()
        except BaseException:
            solver.stop_search()
            raise
