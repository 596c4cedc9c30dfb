"""The source of a policy for its process: a name with options, or a copy of an object."""

from __future__ import annotations

import json
import pickle
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import cloudpickle

from labgym.errors import LabgymError, OptionError
from labgym.policies.policy import Policy
from labgym.policies.process.attachments import (
    Attachment,
    file_attachments,
    module_attachments,
    write_attachments,
)
from labgym.policies.registry import BUILT_IN, checked_policy, make_policy, policy_place


@dataclass(frozen=True)
class PolicySource:
    """The source of a policy for its process.

    Attributes:
        name: name for `make_policy`; for an object, its name in messages.
        options: arguments of `make_policy`, plain JSON data.
        pickled: the policy, if it was passed as an object; its class is contained in it unless the other process can
            import it.
        modules: names of the modules of the object's classes.
        attachments: files for a process on another machine.
    """

    name: str
    options: dict[str, Any] = field(default_factory=dict)
    pickled: bytes | None = field(default=None, repr=False)
    modules: tuple[str, ...] = ()
    attachments: tuple[Attachment, ...] = field(default=(), repr=False)

    @classmethod
    def named(cls, name: str, options: Mapping[str, Any] | None = None) -> PolicySource:
        """Return the source of a policy with a name.

        Raises:
            OptionError: the options are not plain JSON data.
        """
        try:
            return cls(name, json.loads(json.dumps(dict(options or {}))))
        except (TypeError, ValueError) as error:
            raise OptionError(f"options of policy {name!r} must be plain JSON data: {error}") from error

    @classmethod
    def copied(cls, policy: Policy) -> PolicySource:
        """Return the source of copies of a policy in its present state.

        Raises:
            OptionError: the object cannot be pickled.
        """
        try:
            with _by_value(type(policy)):
                modules = {base.__module__ for base in type(policy).__mro__} - {"__main__", "builtins"}
                return cls(policy.name, {}, cloudpickle.dumps(policy), tuple(sorted(modules)))
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            raise OptionError(
                f"policy {policy.name!r} cannot be sent to its process ({reason}); pass it by name: module:Class"
            ) from error

    def portable(self, files: Sequence[Path]) -> PolicySource:
        """Return the source for processes on other machines, on which labgym is installed and nothing else.

        Args:
            files: absolute paths of the files that the policy reads, such as weights.

        Raises:
            OptionError: the files are too large.
        """
        named, modules = [], self.modules
        if self.pickled is None:
            named = [self.name, *(value for value in self.options.values() if isinstance(value, str))]
            modules = (policy_place(self.name).partition(":")[0],)
        return replace(self, attachments=(*module_attachments(modules), *file_attachments(named, files)))

    @property
    def shared_modules(self) -> tuple[str, ...]:
        """Names of the modules of a built-in policy, which the host may import once for all its processes.

        Modules that need an extra are left out: they may start threads, with which a process cannot be forked.
        """
        entry = BUILT_IN.get(self.name) if self.pickled is None else None
        if entry is None or entry.extra:
            return ()
        return (entry.place.partition(":")[0], *(("labgym.layouts",) if entry.sees == "map" else ()))

    def make(self) -> Policy:
        """Return a new policy, or a copy of the object.

        Raises:
            LabgymError: as `make_policy`; or the copy cannot be made in this process.
        """
        places: dict[str, str] = {}
        if self.attachments:
            folder = write_attachments(self.attachments)
            places = {each.names[0]: str(folder / each.names[1]) for each in self.attachments if each.names is not None}
            sys.path.insert(0, str(folder))
        if self.pickled is None:
            options = {
                key: places.get(value, value) if isinstance(value, str) else value
                for key, value in self.options.items()
            }
            return make_policy(places.get(self.name, self.name), **options)
        try:
            policy = pickle.loads(self.pickled)  # noqa: S301 - from the evaluator, which holds the object
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            raise LabgymError(f"policy {self.name!r} cannot be copied into its process: {reason}") from error
        return checked_policy(self.name, policy)


@contextmanager
def _by_value(kind: type) -> Iterator[None]:
    """Pickle the classes of a policy by value that another process could not import."""
    names = {base.__module__ for base in kind.__mro__} - {"__main__", "builtins"}
    with ExitStack() as stack:
        for name in sorted(names):
            module = sys.modules.get(name)
            if module is not None and not _is_importable(module):
                cloudpickle.register_pickle_by_value(module)
                stack.callback(cloudpickle.unregister_pickle_by_value, module)
        yield


def _is_importable(module: ModuleType) -> bool:
    """Return whether the module's name leads another process with the same path to the same file."""
    parent, _, _ = module.__name__.rpartition(".")
    path = None
    if parent:
        package = sys.modules.get(parent)
        if package is None or not _is_importable(package):
            return False
        path = getattr(package, "__path__", None)
    for finder in sys.meta_path:
        find_spec = getattr(finder, "find_spec", None)
        spec = find_spec(module.__name__, path) if find_spec else None
        if spec is not None:
            return spec.origin in (getattr(module, "__file__", None), "built-in", "frozen")
    return False
