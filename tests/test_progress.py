"""Progress in a file or pipe is a few plain lines."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest

from labgym.cli.episodes import task_and_level
from labgym.errors import UnknownNameError
from labgym.eval.labnav.suites import is_labnav, load_labnav
from labgym.progress import progress_bar


@pytest.mark.parametrize("total", [1, 7, 25, 960, 12_345])
def test_without_a_terminal_a_line_comes_every_tenth(total, capsys):
    for _ in progress_bar(range(total), "episodes", unit="ep"):
        pass
    out, err = capsys.readouterr()
    assert out == ""
    assert "\r" not in err
    counts = [
        tuple(map(int, match.groups()))
        for line in err.splitlines()
        if (match := re.fullmatch(r"episodes: (\d+)/(\d+) ep \(\d+%\), \d\d:\d\d", line))
    ]
    assert len(counts) == len(err.splitlines()) <= 12
    assert [counts[0], counts[-1]] == [(0, total), (total, total)]
    steps = [b - a for (a, _), (b, _) in pairwise(counts)]
    assert all(0 < step <= max(1, -(-total // 10)) for step in steps)


def test_progress_that_is_switched_off_writes_nothing(capsys):
    assert list(progress_bar(range(3), "off", disable=True)) == [0, 1, 2]
    assert capsys.readouterr() == ("", "")


def test_a_task_with_its_level_has_one_name_everywhere():
    assert task_and_level("people-3", 2) == task_and_level("labnav-people-3", 2) == ("people", 3)
    assert task_and_level("people", 1) == task_and_level("labnav-people", 1) == ("people", 1)
    assert task_and_level("people-9", 2) == ("people-9", 2)
    assert [load_labnav(name).name for name in ("people-3", "people", "labnav-people")] == [
        "labnav-people-3",
        "labnav-people-2",
        "labnav-people-2",
    ]
    assert is_labnav("glass")
    assert not any(map(is_labnav, ("val", "people-2.json", "glassware", "runs/people-2")))
    with pytest.raises(UnknownNameError, match="'labnav-people-9' not found; nearest: labnav-people"):
        load_labnav("people-9")
