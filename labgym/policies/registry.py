"""Policies by name: those of this package, those that other packages register, and any class by its place."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.policies.policy import Policy

GROUP = "labgym.policies"
"""Entry-point group in which a package names its policies: `name = "module:Class"`."""

BUILT_IN = {
    "astar": "labgym.policies.astar:AStarPolicy",
    "dwa": "labgym.policies.dwa:DwaPolicy",
    "online_map": "labgym.policies.online_map:OnlineMapPolicy",
    "random": "labgym.policies.random_actions:RandomPolicy",
    "straight": "labgym.policies.straight:StraightPolicy",
}


def policy_names() -> tuple[str, ...]:
    """Return the names that `make_policy` knows, sorted; "module:Class" works beside them."""
    return tuple(sorted({*BUILT_IN, *_registered()}))


def make_policy(name: str, **options: Any) -> Policy:
    """Return a new policy.

    Args:
        name: a built-in ("astar", "online_map", "dwa", "straight", "random"), a name that an installed package registers under the
            entry-point group `labgym.policies`, or "module:Class", which must be importable.
        options: arguments of the policy's class.

    Raises:
        UnknownNameError: nothing has that name; lists what has.
        OptionError: the class does not take the options.
        LabgymError: the class cannot be imported, or is no `Policy`.
    """
    factory = _factory(name)
    try:
        policy = factory(**options)
    except TypeError as error:
        raise OptionError(f"policy {name!r} does not take the options {options}: {error}") from error
    if not isinstance(policy, Policy):
        raise LabgymError(f"policy {name!r} is a {type(policy).__name__}; derive it from labgym.policies.Policy")
    return policy


def _factory(name: str) -> Callable[..., object]:
    if name in BUILT_IN:
        return _imported(BUILT_IN[name], name)
    registered = _registered()
    if name in registered:
        return _imported(registered[name].value, name)
    if ":" in name and "/" not in name:
        return _imported(name, name)
    raise UnknownNameError('policy (or "module:Class")', name, policy_names())


def _registered() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _imported(place: str, name: str) -> Callable[..., object]:
    module_name, _, attribute = place.partition(":")
    try:
        found: Any = importlib.import_module(module_name)
        for part in attribute.split("."):
            found = getattr(found, part)
    except Exception as error:
        raise LabgymError(
            f"policy {name!r}: cannot import {place!r} ({error}); its module must be on the Python path"
        ) from error
    if not callable(found):
        raise LabgymError(f"policy {name!r}: {place!r} is a {type(found).__name__}, expected a class or a function")
    return found  # type: ignore[no-any-return]
