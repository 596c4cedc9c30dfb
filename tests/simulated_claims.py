"""What a check says of the episodes of a folder that differ from those of an honest one."""

from __future__ import annotations

from typing import Any

from labgym.eval.submission.claim import Claim, completeness_problems


def problems_of_changes(claim: Claim[Any, Any], honest: Claim[Any, Any]) -> list[str]:
    """Return the problems of the files and, by simulations, of the episodes that differ from an honest folder's."""
    changed = [
        key
        for key in claim.complete
        if claim.rows[key] != honest.rows[key]
        or claim.route(key).tolist() != honest.route(key).tolist()
        or claim.stored_actions(key) != honest.stored_actions(key)
    ]
    problems = [*claim.file_problems, *completeness_problems(claim.keys, claim.given, claim.suite_name)]
    problems += filter(None, map(claim.simulated, changed))
    assert all(problem.isprintable() and len(problem) < 600 for problem in problems)
    return problems
