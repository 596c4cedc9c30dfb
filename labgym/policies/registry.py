"""Policies by name: built-in ones, those that packages register, a class by its place, a file, a server."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import PurePath
from typing import Any

from labgym.errors import (
    LabgymError,
    MissingDependencyError,
    OptionError,
    UnknownArgumentError,
    UnknownNameError,
    one_line,
)
from labgym.policies.policy import Policy
from labgym.table import Table

GROUP = "labgym.policies"
"""Entry-point group under which packages register policies: `name = "module:Class"`."""


@dataclass(frozen=True)
class PolicyEntry:
    """A registered policy.

    Attributes:
        name: for `make_policy`.
        place: "module:Class".
        sees: sensor that it drives on: "lidar", "depth" or "rgbd", "map" for a privileged policy, "world" for one
            that foresees it, "goal" for the goal alone, "none" for nothing.
        extra: extra of the distribution that installs its packages; "" if the base installation is enough.
        summary: one line.
    """

    name: str
    place: str
    sees: str
    extra: str
    summary: str


BUILT_IN = {
    name: PolicyEntry(name, f"labgym.policies.{place}", sees, extra, summary)
    for name, place, sees, extra, summary in (
        ("astar", "astar:AStarPolicy", "map", "", "A* on the true map; the upper bound"),
        ("blind", "blind:BlindPolicy", "map", "", "a path on the map, driven without any sensor"),
        ("bug2", "bug2:Bug2Policy", "lidar", "", "along the line to the goal and obstacles"),
        (
            "clairvoyant",
            "clairvoyant.policy:ClairvoyantPolicy",
            "world",
            "",
            "LabNav's privileged track: true floor, true pose, people's futures",
        ),
        ("dwa", "dwa:DwaPolicy", "lidar", "", "dynamic window towards a via point; no map"),
        (
            "iplanner",
            "iplanner.policy:IPlannerPolicy",
            "depth",
            "train",
            "iPlanner-style: a network plans a path from one depth image",
        ),
        (
            "lidar-lstm",
            "lidar_lstm:LidarLstmPolicy",
            "lidar",
            "train",
            "one network with memory from scans to velocities",
        ),
        (
            "local-imitation",
            "local.policy:ImitationPolicy",
            "map",
            "train",
            "learned local planner on the stack's path, by imitation of the stack",
        ),
        (
            "local-ppo",
            "local.policy:ReinforcementPolicy",
            "map",
            "train",
            "learned local planner on the stack's path, by PPO on LabNav's tasks",
        ),
        (
            "mapless-local",
            "local.policy:MaplessLocalPolicy",
            "lidar",
            "train",
            "the network of local-ppo on a map that it makes while it drives",
        ),
        (
            "mapless-oracle",
            "stack.oracle:MaplessOraclePolicy",
            "world",
            "",
            "mapless-stack with perfect pose and lidar: what a map is worth",
        ),
        (
            "mapless-stack",
            "stack.mapless:MaplessStackPolicy",
            "lidar",
            "",
            "the navigation stack on a map that it makes while it drives",
        ),
        (
            "navdp",
            "navdp.policy:NavDPPolicy",
            "rgbd",
            "train",
            "NavDP-style: trajectories by diffusion, chosen by a critic",
        ),
        ("online_map", "online_map:OnlineMapPolicy", "depth", "", "builds a map while driving and plans on it"),
        ("ppo", "ppo.policy:PPOPolicy", "lidar", "train", "reinforcement learning on lidar"),
        ("ppo-depth", "ppo.policy:PPODepthPolicy", "depth", "train", "reinforcement learning on depth images"),
        ("random", "random_actions:RandomPolicy", "none", "", "random actions; the level of chance"),
        (
            "stack",
            "stack.policy:StackPolicy",
            "map",
            "",
            "navigation stack on an old map with a lidar: localization, costmap, MPPI, docking, people",
        ),
        ("still", "still:StillPolicy", "none", "", "never moves"),
        ("straight", "straight:StraightPolicy", "goal", "", "drives directly at the goal and ignores obstacles"),
    )
}

FILES = {
    ".onnx": "labgym.policies.adapters.onnx:OnnxPolicy",
    ".safetensors": "labgym.policies.adapters.actor:ActorPolicy",
    ".pt": "labgym.policies.adapters.torchscript:TorchScriptPolicy",
    ".torchscript": "labgym.policies.adapters.torchscript:TorchScriptPolicy",
    ".zip": "labgym.policies.adapters.sb3:StableBaselines3Policy",
}
"""Class that loads a policy's file, by its suffix."""

PACKAGES = {"train": ("diffusers", "safetensors", "stable_baselines3", "torch")}
"""Packages that built-in policies import, by the extra that installs them."""

SERVERS = ("http://", "https://")
SERVER = "labgym.policies.http.client:HttpPolicy"
"""Class that drives by a policy server."""


def policies() -> tuple[PolicyEntry, ...]:
    """Return all registered policies, sorted by name; `make_policy` also accepts classes, files and servers.

    Policies of other packages are not imported: that would run their code outside of the box. Their sensor is unknown.
    """
    registered = [_entry_of(entry) for name, entry in _registered().items() if name not in BUILT_IN]
    return tuple(sorted((*BUILT_IN.values(), *registered), key=lambda entry: entry.name))


def policy_names() -> tuple[str, ...]:
    """Return the sorted names of all registered policies; `make_policy` also accepts classes, files and servers."""
    return tuple(sorted({*BUILT_IN, *_registered()}))


def policy_table() -> str:
    """Return a text with one line per policy: name, sensor, required extra and summary."""
    rows = tuple((each.name, each.sees, _needs(each), each.summary) for each in policies())
    files = ".onnx, .pt, .safetensors, .zip of stable-baselines3"
    also = f"Also: module:Class, a file ({files}), or the http:// URL of a server."
    return Table("Policies", ("name", "sees", "needs", "method"), rows, (also,)).text()


def is_class_place(name: str) -> bool:
    """Return whether a policy's name is "module:Class" rather than a registered name, a file or a server."""
    is_file = PurePath(name).suffix.lower() in FILES
    return ":" in name and "/" not in name and not is_file


def policy_place(name: str) -> str:
    """Return the class of a policy as "module:Class", without importing it.

    Args:
        name: as for `make_policy`.

    Raises:
        UnknownNameError: no policy has this name.
    """
    return _place(name)[0]


def _place(name: str) -> tuple[str, bool]:
    """Return the class of a policy, and whether the name is the class's first argument: a file or a server."""
    suffix = PurePath(name).suffix.lower()
    if name in BUILT_IN:
        return BUILT_IN[name].place, False
    if name.startswith(SERVERS):
        return SERVER, True
    if suffix in FILES:
        return FILES[suffix], True
    if is_class_place(name):
        return name, False
    registered = _registered()  # last: it reads all installed distributions
    if name in registered:
        return registered[name].value, False
    raise UnknownNameError('policy (or "module:Class", file or URL)', name, policy_names())


def make_policy(name: str, **arguments: Any) -> Policy:
    """Return a new policy.

    Args:
        name: a built-in ("astar", "straight", ...); a name that an installed package registers under the entry-point
            group `labgym.policies`; "module:Class" on the Python path; the path of a file (.onnx, .pt or .torchscript,
            .safetensors of `labgym train`, .zip of stable-baselines3); or the URL of a server that speaks the NavDP
            benchmark's protocol.
        arguments: arguments of the policy's class. If the class has options (`Policy.options_type`), each may also be
            given by its own name: `make_policy("dwa", radius=0.28)` is `make_policy("dwa", options={"radius": 0.28})`.

    Raises:
        UnknownNameError: no policy has this name, or the policy has no such option; lists the valid names.
        OptionError: an argument is outside its limits.
        MissingDependencyError: a required package is not installed.
        LabgymError: the class cannot be imported, its constructor fails, or it is not a `Policy`.
    """
    factory = _factory(name)
    arguments = _checked(name, factory, arguments)
    try:
        policy = factory(**arguments)
    except LabgymError:
        raise
    except Exception as error:
        reason = one_line(error, 300)
        raise LabgymError(f"policy {name!r}: its constructor failed with {reason}; arguments: {arguments}") from error
    return checked_policy(name, policy)


def checked_policy(name: str, policy: object) -> Policy:
    """Return an object if it is a policy.

    Args:
        name: name of the policy in the error message.
        policy: the object.

    Raises:
        LabgymError: it is not a `Policy`.
    """
    if not isinstance(policy, Policy):
        raise LabgymError(f"policy {name!r} is a {type(policy).__name__}; derive it from labgym.policies.Policy")
    return policy


def _checked(name: str, factory: Callable[..., object], arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments with the policy's options gathered in `options`.

    Raises:
        UnknownArgumentError: an argument does not exist.
        OptionError: an option is given twice, or a required argument is missing.
    """
    kind = factory.func if isinstance(factory, partial) else factory
    try:
        signature = inspect.signature(factory)
    except (TypeError, ValueError):
        return dict(arguments)
    parameters = signature.parameters.values()
    if any(parameter.kind is inspect.Parameter.VAR_KEYWORD for parameter in parameters):
        return dict(arguments)
    names = [each.name for each in parameters if each.kind is not inspect.Parameter.POSITIONAL_ONLY]
    options_type = getattr(kind, "options_type", None)
    fields = set(options_type.model_fields) - set(names) if options_type else set()
    unknown = sorted(arguments.keys() - set(names) - fields)
    if unknown:
        available = {*names, *fields} - ({"options"} if options_type else set())
        raise UnknownArgumentError(f"policy {name!r}", unknown[0], available)
    direct = {option: value for option, value in arguments.items() if option in fields}
    whole = {option: value for option, value in arguments.items() if option not in fields}
    if direct:
        options = whole.get("options") or {}
        if not isinstance(options, Mapping):
            raise OptionError(f"policy {name!r}: options are a {type(options).__name__}; expected a mapping")
        twice = sorted(options.keys() & direct.keys())
        if twice:
            raise OptionError(f"policy {name!r}: option {twice[0]!r} is given twice, by itself and in options")
        whole["options"] = {**options, **direct}
    try:
        signature.bind(**whole)
    except TypeError as error:
        raise OptionError(f"policy {name!r}: {error}; its arguments: {', '.join(names) or 'none'}") from None
    return whole


def _factory(name: str) -> Callable[..., object]:
    place, is_argument = _place(name)
    kind = _imported(place, name)
    return partial(kind, name) if is_argument else kind


def _registered() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _entry_of(entry: EntryPoint) -> PolicyEntry:
    """Return the entry of a policy that another package registers."""
    package = "another package" if entry.dist is None else f"package {entry.dist.name}"
    return PolicyEntry(entry.name, entry.value, "", "", f"{entry.value} of {package}"[:120])


def _needs(entry: PolicyEntry) -> str:
    """Return the extra that a policy requires, marked if a package of it is missing."""
    if not entry.extra:
        return "-"
    missing = [package for package in PACKAGES[entry.extra] if find_spec(package) is None]
    return f"[{entry.extra}]" + (" (missing)" if missing else "")


def _imported(place: str, name: str) -> Callable[..., object]:
    module_name, _, attribute = place.partition(":")
    try:
        target: Any = importlib.import_module(module_name)
        for part in attribute.split("."):
            target = getattr(target, part)
    except Exception as error:
        if isinstance(error, ImportError):
            for extra, packages in PACKAGES.items():
                if error.name in packages:
                    raise MissingDependencyError(str(error.name), f"policy {name!r}", extra) from None
        raise LabgymError(
            f"policy {name!r}: cannot import {place!r} ({error}); its module must be on the Python path"
        ) from error
    if not callable(target):
        raise LabgymError(f"policy {name!r}: {place!r} is a {type(target).__name__}, expected a class or a function")
    return target  # type: ignore[no-any-return]
