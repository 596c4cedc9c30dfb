"""The fingerprint of a policy: two policies with one fingerprint drive alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from labgym.documents import Record, canonical_hash, files_digest
from labgym.errors import OptionError
from labgym.policies.fingerprint.definitions import REMEDY, Definitions, is_labgym
from labgym.policies.fingerprint.sources import module_file, sources_digest
from labgym.policies.fingerprint.values import attributes
from labgym.policies.policy import Policy


class PolicyFingerprint(Record):
    """The identity of a policy in the identity of a run.

    Attributes:
        label: name of the policy in the rows.
        place: its class, "module:Class".
        source: digest of the class's source.
        parameters: digest of its options, or of the object's attributes.
        files: digest of its files, such as weights.
    """

    label: str
    place: str
    source: str
    parameters: str
    files: str


def named_fingerprint(
    label: str, place: str, options: Mapping[str, Any], files: Iterable[Path] = ()
) -> PolicyFingerprint:
    """Return the fingerprint of a policy that is made from a class and options; the class is not imported.

    Args:
        label: name of the policy in the rows.
        place: its class, "module:Class".
        options: arguments of the class, JSON data.
        files: files that it reads, such as weights.

    Raises:
        OptionError: the module has no source file, or a file cannot be read.
    """
    return PolicyFingerprint(
        label=label,
        place=place,
        source=_module_digest(label, place.partition(":")[0]),
        parameters=canonical_hash(dict(options)),
        files=_files_digest(label, files),
    )


def object_fingerprint(policy: Policy, files: Iterable[Path] | None = None) -> PolicyFingerprint:
    """Return the fingerprint of a policy object as it is now.

    Its parameters are `policy.parameters()`, by default its attributes. A class of a notebook counts by its source and
    by what it uses from the notebook.

    Args:
        policy: the object. files: that it reads; None stands for `policy.files()`.

    Raises:
        OptionError: an attribute has no digest, or the source of the class is not known.
    """
    kind, label = type(policy), f"policy {policy.name!r}"
    definitions = Definitions(kind)
    parameters = policy.parameters()
    state = attributes(policy) if parameters is None else parameters
    return PolicyFingerprint(
        label=policy.name,
        place=f"{kind.__module__}:{kind.__qualname__}",
        source=definitions.definition(kind, label),
        parameters=canonical_hash(
            {key: definitions.value(item, f"{label}: attribute {key!r}") for key, item in sorted(state.items())}
        ),
        files=_files_digest(policy.name, policy.files() if files is None else files),
    )


def _module_digest(label: str, module: str) -> str:
    if is_labgym(module):
        return canonical_hash(module)
    file = module_file(module)
    if file is None:
        raise OptionError(f"policy {label!r}: module {module!r} has no source file to identify a run by; {REMEDY}")
    return sources_digest(file, module)


def _files_digest(label: str, files: Iterable[Path]) -> str:
    try:
        return files_digest(files)
    except OSError as error:
        raise OptionError(f"policy {label!r}: file {error.filename} cannot be read ({error.strerror})") from None
