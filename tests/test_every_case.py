from __future__ import annotations

import pytest
from every_case import for_each


def test_all_failing_cases_are_named_and_the_others_run():
    ran = []

    @for_each("number", range(5))
    def odd(number, fixture):
        ran.append((number, fixture))
        assert number % 2, "even"
        if number == 3:
            pytest.fail("three")

    with pytest.raises(BaseExceptionGroup, match="4 of 5 cases failed") as caught:
        odd(fixture="shared")
    assert ran == [(number, "shared") for number in range(5)]
    assert [error.__notes__ for error in caught.value.exceptions] == [[f"case {number}"] for number in (0, 2, 3, 4)]


@for_each(("first", "second"), [(1, 2), (3, 4)])
def test_cases_of_several_arguments_share_their_fixtures(first, second, tmp_path):
    assert second == first + 1
    assert tmp_path.is_dir()


def test_no_cases_are_refused():
    with pytest.raises(ValueError, match="no cases for number"):
        for_each("number", [])
