"""The command that repairs layouts."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from tyro.conf import OmitArgPrefixes

from labgym.cli.arguments import DEFAULT_RULES, LayoutName, OptionalPath, OptionalText, RuleArguments
from labgym.cli.outcome import DONE, FAILED
from labgym.cli.saving import Overwrite, layout_path, refuse_other_content, save

if TYPE_CHECKING:
    from labgym.layouts.repairs import Repair


def repair(
    layout: LayoutName,
    out: OptionalPath = None,
    rules: OmitArgPrefixes[RuleArguments] = DEFAULT_RULES,
    protocol: OptionalText = None,
    adjuster: str = "rules",
    trace: OptionalPath = None,
    overwrite: Overwrite = False,
) -> int:
    """Repair a layout: hand-edited, imported from another program, or proposed by a model.

    Items return to surfaces, reagents to cabinets and furniture to walls; what the protocol requires and is missing is
    added; objects that need not move stay. Under the rule set touchstone, vessels also return to their hood, the pieces
    of an apparatus to each other and wall units to walls. Optional pieces beyond their greatest number are removed, and
    in a layout without faults at most 6 objects move for soft terms. Each change is printed with its reason, and what
    could not be repaired; the exit code is then 1. Objects with `fixed` never move.

    Args:
        layout: A layout's .json file, or the id of a published layout.
        out: The .json file of the repaired layout; with --overwrite it may be the same file. Default:
            NAME-repaired.json in the current folder.
        protocol: Id or .json file of the protocol to repair the layout for; by default all protocols of the layout.
        adjuster: What adjusts the layout where repair by geometry does not help: rules, or llm, the configured language
            model (docs/language-models.md).
        trace: A .json file for every state of the layout and every command that was tried; labgym trace draws it.
        overwrite: Replace OUT and the trace if they exist with other content.
    """
    from labgym import protocols
    from labgym.envs.tasks import resolve_layout
    from labgym.layouts.method import make_adjuster
    from labgym.layouts.repairs import repair_layout
    from labgym.layouts.trace import Recorder

    target = layout_path(out if out is not None else Path(f"{Path(layout).stem}-repaired.json"))
    chosen = None if protocol is None else protocols.resolve(protocol)
    recorder = None if trace is None else Recorder()
    chosen_rules = rules.rule_set()
    result = repair_layout(resolve_layout(layout), chosen, chosen_rules, make_adjuster(adjuster), recorder)
    refuse_other_content(result.layout, target, overwrite)
    for change in result.changes:
        print(f"{change.text} ({change.reason})" if change.reason else change.text)
    print(_summary(result))
    save(result.layout, target, overwrite)
    if recorder is not None and trace is not None:
        save(recorder.trace(), trace, overwrite)
    for problem in result.problems:
        print(f"labgym: not repaired: {problem}", file=sys.stderr)
    return FAILED if result.problems else DONE


def _summary(result: Repair) -> str:
    """Return one line on how many objects changed, and the violations before and after."""
    counts = Counter(change.kind for change in result.changes)
    total, moved = len(result.layout.placements), counts["moved"] + counts["resettled"]
    numbers = [(a.v, len(a.errors), len(a.lacking)) for a in (result.before, result.after)]
    parts = [
        f"{name} {before} -> {after}"
        for name, before, after in zip(("violations", "facility errors", "missing assets"), *numbers, strict=True)
    ]
    removed = f", {counts['removed']} removed" if counts["removed"] else ""
    return f"{moved} of {total} objects moved, {counts['added']} added{removed}; {', '.join(parts)}"
