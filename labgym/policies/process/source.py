"""The source of a policy for its process: a name with options or a copy of an object, and the files that it needs."""

from __future__ import annotations

import json
import pickle
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import cloudpickle

from labgym.artefacts import user_cache
from labgym.documents import canonical_hash, write_bytes
from labgym.errors import LabgymError, OptionError, one_line
from labgym.policies.fingerprint.sources import is_installed_file, module_file, source_files
from labgym.policies.policy import Policy
from labgym.policies.registry import BUILT_IN, SERVERS, checked_policy, make_policy, policy_place
from labgym.runs import Blob

MAPS = "labgym.layouts"
"""Module that unpickles the maps of episodes."""
MAX_BYTES = 512 * 2**20
"""Largest size of all attachments of a policy."""


@dataclass(frozen=True)
class Attachment:
    """A file that travels with a policy.

    Attributes:
        path: its path relative to the folder of the attachments.
        content: its bytes.
        names: the name or option of the policy that stands for it, and the path that replaces it there; None for the
            source files of a module, which are imported.
    """

    path: str
    content: Blob
    names: tuple[str, str] | None = None


def module_attachments(modules: Iterable[str]) -> tuple[Attachment, ...]:
    """Return the source files of modules that are not installed, with the modules of their folders that they import."""
    sources: dict[str, Path] = {}
    for module in modules:
        file = module_file(module)
        if file is not None and not is_installed_file(file):
            sources |= source_files(file, module)
    return _checked([Attachment(path, Blob(file.read_bytes())) for path, file in sorted(sources.items())])


def file_attachments(texts: Iterable[str], files: Sequence[Path]) -> tuple[Attachment, ...]:
    """Return those of a policy's files that a text names: the file itself, or a folder that holds it.

    Args:
        texts: the policy's name and its options.
        files: absolute paths of the files that the policy reads.
    """
    attachments = []
    for number, text in enumerate(texts):
        named = Path(text).absolute()
        for file in files:
            if file == named or file.is_relative_to(named):
                root = f"{number}/{named.name}"
                path = root if file == named else f"{root}/{file.relative_to(named).as_posix()}"
                attachments.append(Attachment(path, Blob(file.read_bytes()), (text, root)))
    return _checked(attachments)


def write_attachments(attachments: Sequence[Attachment]) -> Path:
    """Write attachments to the user's cache, where nothing else changes them, and return their folder."""
    digest = canonical_hash([[each.path, each.content.digest] for each in attachments])
    folder = _cache() / digest
    for each in attachments:
        path = folder / each.path
        if not path.is_file() or path.read_bytes() != each.content.content:
            write_bytes(path, each.content.content)
    return folder


def _cache() -> Path:
    folder = user_cache() / "attachments"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="labgym-attachments-"))
    return folder


def _checked(attachments: list[Attachment]) -> tuple[Attachment, ...]:
    size = sum(len(each.content.content) for each in attachments)
    if size > MAX_BYTES:
        raise OptionError(f"the files of the policy have {size} bytes; at most {MAX_BYTES} are sent to other machines")
    return tuple(attachments)


@dataclass(frozen=True)
class PolicySource:
    """The source of a policy for its process.

    Attributes:
        name: name for `make_policy`; for an object, its name in messages.
        options: arguments of `make_policy`, plain JSON data.
        pickled: the policy, if it was passed as an object; its class is contained in it unless the other process can
            import it.
        modules: names of the modules of the object's classes.
        stated: paths of the files that the object states (`Policy.files`).
        attachments: files for a process on another machine.
        hidden: absolute paths of files and folders that the policy must not read, also in its folder.
    """

    name: str
    options: dict[str, Any] = field(default_factory=dict)
    pickled: bytes | None = field(default=None, repr=False)
    modules: tuple[str, ...] = ()
    stated: tuple[str, ...] = ()
    attachments: tuple[Attachment, ...] = field(default=(), repr=False)
    hidden: tuple[str, ...] = ()

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
                stated = tuple(str(Path(path).absolute()) for path in policy.files())
                return cls(policy.name, {}, cloudpickle.dumps(policy), tuple(sorted(modules)), stated)
        except Exception as error:
            reason = one_line(error, 300)
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
    def built_in(self) -> bool:
        """Whether the policy is labgym's own, by name."""
        return self.pickled is None and self.name in BUILT_IN

    @property
    def foreign(self) -> bool:
        """Whether code of somebody else drives, which belongs into a box.

        A server's policy runs elsewhere: the process here has labgym's client, which needs the network.
        """
        return not self.built_in and (self.pickled is not None or not self.name.startswith(SERVERS))

    @property
    def shared_modules(self) -> tuple[str, ...]:
        """Names of the modules of a built-in policy, which the host may import once for all its processes.

        Modules that need an extra are left out: they may start threads, with which a process cannot be forked.
        """
        entry = BUILT_IN.get(self.name) if self.pickled is None else None
        if entry is None or entry.extra:
            return ()
        return (entry.place.partition(":")[0], *((MAPS,) if entry.sees == "map" else ()))

    def installed(self) -> PolicySource:
        """Return the source with its attachments written to this machine, where the policy and its options name them.

        The folder of the attachments comes first on the Python path of this process.
        """
        if not self.attachments:
            return self
        folder = write_attachments(self.attachments)
        sys.path[:] = [str(folder), *(path for path in sys.path if path != str(folder))]
        places = {each.names[0]: str(folder / each.names[1]) for each in self.attachments if each.names is not None}
        options = {
            key: places.get(value, value) if isinstance(value, str) else value for key, value in self.options.items()
        }
        return replace(self, name=places.get(self.name, self.name), options=options, attachments=())

    def make(self) -> Policy:
        """Return a new policy, or a copy of the object.

        Raises:
            LabgymError: as `make_policy`; or the copy cannot be made in this process.
        """
        if self.pickled is None:
            return make_policy(self.name, **self.options)
        try:
            policy = pickle.loads(self.pickled)  # noqa: S301 - from the evaluator, which holds the object
        except Exception as error:
            reason = one_line(error, 300)
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
