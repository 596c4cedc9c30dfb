"""Digests of Python values that are equal in every process: parameters of policies."""

from __future__ import annotations

import dataclasses
import hashlib
import struct
import sys
import types
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from labgym.errors import OptionError

DefinitionDigest = Callable[[object, str], str]
"""Returns the digest of a class, a function or another callable; the text names the value, for errors."""

MAX_DEPTH = 100


def value_digest(value: object, name: str, definition: DefinitionDigest) -> str:
    """Return the SHA-256 of a value, by type and content.

    Digestible are None, booleans, numbers, texts, bytes, paths, enumerations, lists, tuples, sets, dictionaries, NumPy
    arrays and generators, PyTorch tensors and modules, dataclasses, pydantic models, classes and functions, and
    objects of classes written in Python. The order of sets and dictionaries does not matter.

    Args:
        value: the value.
        name: name of the value in errors.
        definition: digest of a class or a function.

    Raises:
        OptionError: the value contains something else; names it.
    """
    return _Digest(definition).of(value, name).hex()


class _Digest:
    """A digest in progress.

    Attributes:
        path: ids of the containers around the present value, so that a cycle ends.
    """

    def __init__(self, definition: DefinitionDigest) -> None:
        self._definition = definition
        self._path: list[int] = []

    def of(self, value: object, name: str) -> bytes:
        """Return the digest of a value."""
        simple = _simple(value)
        if simple is not None:
            return _hash(*simple)
        if id(value) in self._path:
            return _hash(b"cycle", str(len(self._path) - self._path.index(id(value))).encode())
        if len(self._path) >= MAX_DEPTH:
            raise OptionError(f"{name[:120]}: nested deeper than {MAX_DEPTH} levels; simplify the parameter")
        self._path.append(id(value))
        try:
            return self._of_container(value, name)
        finally:
            self._path.pop()

    def _of_container(self, value: object, name: str) -> bytes:
        kind = type(value)
        if kind in (list, tuple):
            return _hash(kind.__name__.encode(), *self._all(value, name))  # type: ignore[arg-type] # a sequence
        if isinstance(value, deque) and kind is deque:
            return _hash(b"deque", str(value.maxlen).encode(), *self._all(value, name))
        if kind in (set, frozenset):
            return _hash(kind.__name__.encode(), *sorted(self._all(value, name)))  # type: ignore[arg-type] # a set
        if kind in (dict, OrderedDict):
            return _hash(kind.__name__.encode(), self._mapping(value, name))  # type: ignore[arg-type] # a dictionary
        if isinstance(value, np.ndarray) and kind is np.ndarray:
            return self._array(value, name)
        if isinstance(value, np.random.Generator):
            return _hash(b"generator", self.of(value.bit_generator.state, name))
        torch = sys.modules.get("torch")
        if torch is not None and isinstance(value, torch.Tensor):
            return self._tensor(value, name)
        if torch is not None and isinstance(value, torch.nn.Module):
            return self._module(value, name)
        if torch is not None and isinstance(value, torch.Generator):
            return _hash(b"generator", self._tensor(value.get_state(), name))
        return self._object(value, name)

    def _all(self, values: Iterable[object], name: str) -> list[bytes]:
        return [self.of(item, f"{name}[{index}]") for index, item in enumerate(values)]

    def _mapping(self, values: Mapping[Any, object], name: str) -> bytes:
        parts = [(self.of(key, f"a key of {name}"), self.of(item, _member(name, key))) for key, item in values.items()]
        return _hash(b"mapping", *(part for pair in sorted(parts) for part in pair))

    def _array(self, array: NDArray[Any], name: str) -> bytes:
        shape = str(array.shape).encode()
        if array.dtype.hasobject:
            return _hash(b"array", b"object", shape, *self._all(array.ravel().tolist(), name))
        return _hash(b"array", str(array.dtype.descr).encode(), shape, np.ascontiguousarray(array).tobytes())

    def _tensor(self, tensor: Any, name: str) -> bytes:
        import torch

        if tensor.layout is not torch.strided or tensor.is_quantized or tensor.is_meta:
            raise OptionError(f"{name}: only dense tensors have a digest, not one of layout {tensor.layout}")
        shape, kind = str(tuple(tensor.shape)).encode(), str(tensor.dtype).encode()
        content = tensor.detach().cpu().contiguous().reshape(-1).view(torch.uint8).numpy().tobytes()
        return _hash(b"tensor", kind, shape, content)

    def _module(self, module: Any, name: str) -> bytes:
        """Return the digest of a PyTorch module: classes, settings, parameters and buffers of all its parts."""
        parts = [b"module"]
        for place, part in module.named_modules():
            label = f"{name}.{place}" if place else name
            settings = {key: item for key, item in vars(part).items() if not key.startswith("_")}
            parts += [place.encode(), self._class(type(part), label), self._mapping(settings, label)]
        tensors = [*module.named_parameters(remove_duplicate=False), *module.named_buffers(remove_duplicate=False)]
        for place, tensor in tensors:
            parts += [place.encode(), self._tensor(tensor, f"{name}.{place}")]
        return _hash(*parts)

    def _object(self, value: object, name: str) -> bytes:
        kind = type(value)
        if isinstance(value, type | types.FunctionType) or _is_importable(value):
            return _hash(b"definition", self._definition(value, name).encode())
        if isinstance(value, types.MethodType):
            return _hash(b"method", self.of(value.__self__, name), self.of(value.__func__, name))
        if isinstance(value, BaseModel):
            extra = value.__pydantic_extra__ or {}
            state = {field: getattr(value, field) for field in type(value).model_fields} | extra
        elif dataclasses.is_dataclass(value):
            state = {field.name: getattr(value, field.name, None) for field in dataclasses.fields(value)}
            state |= getattr(value, "__dict__", {})
        elif _is_python_class(kind):
            state = attributes(value)
            content = next((base for base in _CONTAINERS if isinstance(value, base)), None)
            if content is not None:
                state["content"] = content(value)
        else:
            place = f"{kind.__module__}.{kind.__qualname__}"
            raise OptionError(
                f"{name} is a {place}, which has no digest to identify a run by: pass the "
                "policy by name with plain options, or define its `parameters`"
            )
        return _hash(b"object", self._class(kind, name), self._mapping(state, name))

    def _class(self, kind: type, name: str) -> bytes:
        return _hash(b"class", self._definition(kind, name).encode())


def attributes(value: object) -> dict[str, Any]:
    """Return the attributes of an object, in `__dict__` and in slots."""
    slots = {
        name: getattr(value, name)
        for kind in type(value).__mro__
        for name in _slots(kind)
        if name not in ("__dict__", "__weakref__") and hasattr(value, name)
    }
    return {**slots, **getattr(value, "__dict__", {})}


def _slots(kind: type) -> tuple[str, ...]:
    slots = kind.__dict__.get("__slots__", ())
    return (slots,) if isinstance(slots, str) else tuple(slots)


def _simple(value: object) -> tuple[bytes, ...] | None:
    """Return type and content of a value without parts; None for another value."""
    kind = type(value)
    if kind in _CONTENT:
        return kind.__name__.encode(), _CONTENT[kind](value)
    if isinstance(value, np.generic) and not value.dtype.hasobject:
        return b"scalar", str(value.dtype.descr).encode(), value.tobytes()
    if isinstance(value, np.dtype):
        return b"dtype", str(value.descr).encode()
    if isinstance(value, PurePath):
        return b"path", str(value).encode("utf-8", "surrogateescape")
    if isinstance(value, Enum):
        return b"enum", f"{kind.__module__}:{kind.__qualname__}:{value.name}".encode()
    torch = sys.modules.get("torch")
    if torch is not None and isinstance(value, torch.dtype | torch.device):
        return b"torch", str(value).encode()
    return None


_CONTENT: dict[type, Callable[[Any], bytes]] = {
    type(None): lambda _: b"",
    bool: lambda value: b"1" if value else b"0",
    int: lambda value: hex(value).encode(),
    float: lambda value: struct.pack("<d", value),
    complex: lambda value: struct.pack("<dd", value.real, value.imag),
    str: lambda value: value.encode("utf-8", "surrogatepass"),
    bytes: bytes,
    bytearray: bytes,
    range: lambda value: repr(value).encode(),
}
"""Content of a value by its exact type."""


_CONTAINERS: tuple[type, ...] = (dict, list, tuple, set, frozenset)


def _is_python_class(kind: type) -> bool:
    """Return whether a class is written in Python, and its bases also or containers: attributes are all their state."""
    bases = [base for base in kind.__mro__[:-1] if base not in (*_CONTAINERS, OrderedDict)]
    return not issubclass(kind, type) and not any(map(_is_extension_class, bases))


def _is_extension_class(kind: type) -> bool:
    """Return whether a class is written in C: it has descriptors that only C types have, or no Python file."""
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    if kind.__module__ != "__main__" and not str(file).endswith(".py"):
        return True
    own = vars(kind).values()
    foreign = (types.WrapperDescriptorType, types.MethodDescriptorType, types.ClassMethodDescriptorType)
    has_extension_new = isinstance(vars(kind).get("__new__"), types.BuiltinFunctionType)
    return has_extension_new or any(isinstance(item, foreign) and item.__objclass__ is kind for item in own)


def _is_importable(value: object) -> bool:
    """Return whether a callable is what its module has under its name: a function of an extension, for example."""
    module = sys.modules.get(getattr(value, "__module__", None) or "")
    name = getattr(value, "__qualname__", None) or getattr(value, "__name__", None)
    return callable(value) and isinstance(name, str) and getattr(module, name, None) is value


def _member(name: str, key: object) -> str:
    return f"{name}.{key}" if isinstance(key, str) and key.isidentifier() else f"{name}[{str(key)[:40]!r}]"


def _hash(*parts: bytes) -> bytes:
    """Return the SHA-256 of parts, each with its length."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.digest()
