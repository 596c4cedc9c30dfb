"""A served policy runs in its process; runs, summaries, tables and checks state the level of the box."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laboratories import small_laboratory

from labgym.confinement import NOT_BOXED, probe
from labgym.errors import LabgymError
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.foresight import handed_track
from labgym.eval.reports.tables import evaluation_table, unranked_notes
from labgym.eval.submission.record_checks import box_problems
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.http.server import NavigationServer
from labgym.policies.process import IsolatedPolicy, PolicyProcess, PolicySource
from labgym.policies.process.box import BUILT_IN_CODE, is_rankable
from labgym.runs.identity import read_identity
from labgym.suites import Suite

HERE = Path(__file__).parent
BRIEF = Suite(name="brief", max_steps=3)


@pytest.fixture(autouse=True)
def users_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)


def start() -> EpisodeStart:
    return EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0))


def test_a_served_policy_keeps_its_process_and_answers_all_questions() -> None:
    policy = IsolatedPolicy(PolicySource.named("hostile:Planning"))
    try:
        assert (policy.goal_kinds, policy.box) == (("point", "none"), str(probe()))
        answers = []
        for _ in range(3):
            policy.reset(start())
            stops = policy.stop({})
            path = policy.planned_path()
            answers.append((stops, None if stops else policy.act({}).tolist(), None if path is None else path.tolist()))
    finally:
        policy.close()
    forward = [pytest.approx(0.1), pytest.approx(0.2)]
    assert answers == [
        (False, [forward[0], 0.0], None),
        (False, [forward[1], 0.0], [[0.0, 0.0], [1.0, 0.5]]),
        (True, None, None),
    ]


def test_the_server_refuses_a_policy_that_needs_the_map() -> None:
    with pytest.raises(Exception, match="cannot be served: it needs the map"):
        NavigationServer(lambda: IsolatedPolicy(PolicySource.named("astar")), port=0)


def test_a_run_states_the_level_of_its_box(tmp_path: Path) -> None:
    layout = small_laboratory("levels")
    levels = {}
    for name in ("hostile:Plain", "straight"):
        report = evaluate(name, [layout], out=tmp_path / name[:4], progress=False)
        identity = read_identity(tmp_path / name[:4])
        assert identity is not None
        levels[name] = (identity.inputs["box"], report.summary.box)
        assert list(box_problems(identity, report.summary.box)) == []
    assert levels == {"hostile:Plain": (str(probe()),) * 2, "straight": (BUILT_IN_CODE,) * 2}
    assert "box" not in report.summary.to_json()
    foreign = read_identity(tmp_path / "host")
    assert foreign is not None
    forged, posing = box_problems(foreign, BUILT_IN_CODE)
    assert "differ in box" in forged
    assert "'hostile:Plain'" in posing
    unboxed = report.summary.model_copy(update={"box": NOT_BOXED})
    assert unranked_notes([report.summary, unboxed]) == (
        "straight is not boxed, and so not ranked: the policy could read published floors, use the network and leave "
        "notes.",
    )
    assert not any("not ranked" in note for note in evaluation_table(report).notes)


def test_not_isolated_is_not_boxed() -> None:
    report = evaluate("hostile:Plain", [small_laboratory("levels")], progress=False, isolated=False)
    assert report.summary.box == NOT_BOXED
    assert any("not ranked" in note for note in evaluation_table(report).notes)


@pytest.mark.parametrize(
    ("level", "rankable"), [(BUILT_IN_CODE, True), ("landlock-1+seccomp", True), (NOT_BOXED, False), ("boxed", False)]
)
def test_only_boxed_and_built_in_policies_are_ranked(level: str, rankable: bool) -> None:
    assert is_rankable(level) is rankable


def test_the_track_is_what_was_handed_over() -> None:
    assert [handed_track(*given) for given in ((None, None), (object(), None), (object(), object()))] == [
        "mapless",
        "deployed",
        "privileged",
    ]


@pytest.mark.skipif(not probe().boxed, reason="this kernel has no Landlock or no seccomp")
@pytest.mark.filterwarnings("ignore:.*torch.jit.*:DeprecationWarning")
def test_a_program_in_a_file_needs_no_trust_in_the_box(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")

    class Steady(torch.nn.Module):
        def forward(self, goal: torch.Tensor) -> torch.Tensor:
            return goal[0, :2] * 0.0 + 0.25

    path = tmp_path / "p.pt"
    torch.jit.script(Steady()).save(str(path))
    with pytest.raises(LabgymError, match="trust=true"):
        make_policy(str(path))
    process = PolicyProcess(PolicySource.named(str(path)))
    try:
        assert process.box == str(probe())
        process.reset(start())
        assert process.act({"goal": np.zeros(3, np.float32)}).tolist() == [0.25, 0.25]
    finally:
        process.close()
