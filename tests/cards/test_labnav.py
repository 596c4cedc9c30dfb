"""Every card leads with the published LabNav row of its policy and how it fails, as the command makes it."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import pytest

from labgym.cards.labnav import BEGIN, END, FAILURES, UNDRIVEN, board, failures, head, headed
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.leaderboard.labnav import published_results
from labgym.policies.registry import BUILT_IN

ROOT = Path(__file__).parents[2]
CARDS = sorted((ROOT / "policies").glob("*/CARD.md"))
RESULTS = {result.summary.policy: result for result in published_results()}


def name_of(card: Path) -> str:
    return card.read_text().partition(":")[0].removeprefix("# ")


def published(policy: str) -> dict:
    return json.loads((ROOT / "eval" / "leaderboard" / "labnav" / f"{policy}.json").read_text())


@pytest.mark.parametrize("card", CARDS, ids=lambda card: card.parent.name)
def test_a_card_leads_with_its_row_as_the_command_writes_it(card):
    text = card.read_text()
    assert text == headed(text)
    lines = text.splitlines()
    assert lines[0].startswith("# ")
    assert lines[2] == BEGIN
    if name_of(card) not in RESULTS:
        assert lines[4] == UNDRIVEN
        return
    labnav = published(name_of(card))["summary"]["labnav"]
    shown = f"**LabNav {labnav['value']:.1f} [{labnav['low']:.1f}, {labnav['high']:.1f}]** of 100"
    assert lines[4].startswith(shown)
    assert lines[5].startswith("**How it fails**: of all episodes it ")


@pytest.mark.parametrize("policy", RESULTS)
def test_the_shares_are_those_of_the_published_outcomes(policy):
    """Counted from the outcomes of the file, with no use of its summary."""
    outcomes = published(policy)["outcomes"]
    endings = Counter(one["ending"] for one in outcomes)
    text = head(RESULTS[policy]).splitlines()[1]
    for words, names in FAILURES.items():
        share = 100.0 * sum(endings[name] for name in names) / len(outcomes)
        shown = re.search(rf"{words} (under 1|\d+)%", text)
        if share == 0.0:
            assert shown is None
        else:
            assert shown is not None, (words, share)
            assert shown[1] == "under 1" if share < 0.5 else abs(int(shown[1]) - share) <= 0.5 + 1e-9
    assert set(endings) <= {"success", *(name for names in FAILURES.values() for name in names)}


def test_failures_name_every_ending_once():
    endings = [name for names in FAILURES.values() for name in names]
    assert len(set(endings)) == len(endings)
    assert {*endings, "success"} == set(LabNavRow.model_fields["ending"].annotation.__args__)
    assert failures({"success": 3}) == ""
    assert failures({"success": 1, "contact": 2, "lost": 1}) == "touches something 50%, stops away from the goal 25%"
    assert failures({"success": 999, "time": 1}) == "runs out of time under 1%"


def test_a_head_replaces_the_earlier_one_and_keeps_the_card():
    card = "# stack: a stack\n\nText.\n\n## Results\n"
    once = headed(card)
    assert headed(once) == once
    assert once.endswith(f"{END}\n\nText.\n\n## Results\n")
    assert UNDRIVEN in headed("# mine: my own\n\nText.\n")


def test_every_policy_with_a_published_row_has_a_card_or_a_line_of_the_classical_policies():
    carded = {name_of(card) for card in CARDS}
    page = (ROOT / "docs" / "classical-policies.md").read_text()
    block = page.partition(BEGIN)[2].partition(END)[0]
    assert page.index(BEGIN) < 300
    others = [name for name in RESULTS if name not in carded]
    assert block.strip() == board(list(RESULTS.values()), others).strip()
    for name in others:
        assert f"| `{name}` | {published(name)['summary']['labnav']['value']:.1f} [" in block
    assert set(others) <= set(BUILT_IN) - carded - {"random"}
