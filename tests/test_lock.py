"""requirements.lock: every package pinned and hashed within the ranges of pyproject.toml, nothing missing."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
ENTRY = re.compile(r"^([A-Za-z0-9._-]+)==([^\s\\]+) \\\n((?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)", re.MULTILINE)
MACHINE = {
    "python_version": "3.11",
    "python_full_version": "3.11.0",
    "sys_platform": "linux",
    "platform_system": "Linux",
}


def lock() -> dict[str, str]:
    text = (ROOT / "requirements.lock").read_text()
    return {canonicalize_name(name): version for name, version, _ in ENTRY.findall(text)}


def declared() -> list[Requirement]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = [*project["dependencies"], *(line for lines in project["optional-dependencies"].values() for line in lines)]
    return [each for each in map(Requirement, lines) if each.name != project["name"]]


def test_every_line_is_a_pin_with_hashes_and_names_no_address():
    text = (ROOT / "requirements.lock").read_text()
    body = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("#"))
    assert ENTRY.sub("", body) == ""
    assert len(lock()) > len(declared())
    assert not re.search(r"https?://|file:|--index|--find-links", text)


def test_every_declared_dependency_is_pinned_within_its_bounds():
    pins = lock()
    for requirement in declared():
        assert requirement.specifier.contains(pins[canonicalize_name(requirement.name)]), str(requirement)


def needed(name: str, extras: frozenset[str]) -> list[Requirement]:
    """Return what an installed package requires on the machine of the lock."""
    try:
        lines = distribution(name).requires or []
    except PackageNotFoundError:
        return []
    found = []
    for requirement in map(Requirement, lines):
        marker = requirement.marker
        if marker is None or any(marker.evaluate({**MACHINE, "extra": extra}) for extra in extras or {""}):
            found.append(requirement)
    return found


def test_nothing_that_a_locked_package_requires_is_missing():
    pins = lock()
    pending = [(canonicalize_name(each.name), frozenset(each.extras)) for each in declared()]
    done = set()
    while pending:
        name, extras = pending.pop()
        if (name, extras) in done:
            continue
        done.add((name, extras))
        assert name in pins, name
        try:
            if distribution(name).version != pins[name]:
                continue  # another version is installed here; its requirements are not those of the lock
        except PackageNotFoundError:
            continue
        for requirement in needed(name, extras):
            assert requirement.specifier.contains(
                pins.get(canonicalize_name(requirement.name), "0"), prereleases=True
            ), f"{name} requires {requirement}"
            pending.append((canonicalize_name(requirement.name), frozenset(requirement.extras)))
    assert {name for name, _ in done} == set(pins), "the lock has packages that nothing requires"


@pytest.mark.parametrize("line", ["PIP_FIND_LINKS", "PIP_EXTRA_INDEX_URL", "Python 3.11", "x86-64"])
def test_the_header_says_what_the_hashes_belong_to(line):
    header = "".join(each for each in (ROOT / "requirements.lock").open() if each.startswith("#"))
    assert line in header
