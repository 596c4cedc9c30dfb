"""Policies by name: those of this package, those that others register, a class by its place, a file, a server."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Iterable
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import PurePath
from typing import Any

from labgym.errors import LabgymError, MissingDependencyError, OptionError, UnknownNameError
from labgym.policies.policy import Policy

GROUP = "labgym.policies"
"""Entry-point group in which a package names its policies: `name = "module:Class"`."""

BUILT_IN = {
    "astar": "labgym.policies.astar:AStarPolicy",
    "dwa": "labgym.policies.dwa:DwaPolicy",
    "iplanner": "labgym.policies.iplanner.policy:IPlannerPolicy",
    "navdp": "labgym.policies.navdp.policy:NavDPPolicy",
    "online_map": "labgym.policies.online_map:OnlineMapPolicy",
    "ppo": "labgym.policies.ppo.policy:PPOPolicy",
    "ppo-depth": "labgym.policies.ppo.policy:PPODepthPolicy",
    "random": "labgym.policies.random_actions:RandomPolicy",
    "straight": "labgym.policies.straight:StraightPolicy",
}

FILES = {
    ".onnx": "labgym.policies.adapters.onnx:OnnxPolicy",
    ".pt": "labgym.policies.adapters.torchscript:TorchScriptPolicy",
    ".torchscript": "labgym.policies.adapters.torchscript:TorchScriptPolicy",
    ".zip": "labgym.policies.adapters.sb3:StableBaselines3Policy",
}
"""What loads a file that a policy is in, by its ending."""

EXTRAS = {"diffusers": "train", "safetensors": "train", "stable_baselines3": "train", "torch": "train"}
"""Packages that built-in policies need beyond the base, and the extra that brings each."""

SERVERS = ("http://", "https://")


def policy_names() -> tuple[str, ...]:
    """Return the names that `make_policy` knows, sorted; classes, files and servers work beside them."""
    return tuple(sorted({*BUILT_IN, *_registered()}))


def make_policy(name: str, **options: Any) -> Policy:
    """Return a new policy.

    Args:
        name: a built-in ("astar", "straight", ...), a name that an installed package registers under the
            entry-point group `labgym.policies`; "module:Class", which must be importable; the path of a file (.onnx,
            .pt or .torchscript, .zip of stable-baselines3); or the URL of a server of the NavDP benchmark's protocol.
        options: arguments of the policy's class.

    Raises:
        UnknownNameError: nothing has that name; lists what has.
        OptionError: the class does not take the options.
        MissingDependencyError: a built-in needs a package that is not installed.
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


def parse_options(texts: Iterable[str]) -> dict[str, Any]:
    """Return options for `make_policy` from texts NAME=VALUE; a value that is JSON is read as such, else as text.

    Raises:
        OptionError: a text has no name.
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.isidentifier():
            raise OptionError(f"option {text[:80]!r} is not NAME=VALUE, such as replan=2")
        try:
            found[name] = json.loads(value)
        except (ValueError, RecursionError):
            found[name] = value
    return found


def _factory(name: str) -> Callable[..., object]:
    if name in BUILT_IN:
        return _imported(BUILT_IN[name], name)
    registered = _registered()
    if name in registered:
        return _imported(registered[name].value, name)
    if name.startswith(SERVERS):
        return partial(_imported("labgym.policies.http.client:HttpPolicy", name), name)
    ending = PurePath(name).suffix.lower()
    if ending in FILES:
        return partial(_imported(FILES[ending], name), name)
    if ":" in name and "/" not in name:
        return _imported(name, name)
    raise UnknownNameError('policy (or "module:Class", file or URL)', name, policy_names())


def _registered() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _imported(place: str, name: str) -> Callable[..., object]:
    module_name, _, attribute = place.partition(":")
    try:
        found: Any = importlib.import_module(module_name)
        for part in attribute.split("."):
            found = getattr(found, part)
    except Exception as error:
        if isinstance(error, ImportError) and error.name in EXTRAS:
            raise MissingDependencyError(error.name, f"policy {name!r}", EXTRAS[error.name]) from None
        raise LabgymError(
            f"policy {name!r}: cannot import {place!r} ({error}); its module must be on the Python path"
        ) from error
    if not callable(found):
        raise LabgymError(f"policy {name!r}: {place!r} is a {type(found).__name__}, expected a class or a function")
    return found  # type: ignore[no-any-return]
