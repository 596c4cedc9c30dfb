"""The files that a USD stage is composed of, and USDZ packages: checked before they are read."""

from __future__ import annotations

import zipfile
from pathlib import Path, PurePosixPath
from typing import Any

from labgym.assets.meshes.model import MeshError, MeshLimits, printable

MAX_ENTRIES = 1024


def check_package(path: Path, limits: MeshLimits) -> None:
    """Check a usdz file's directory: only stored entries, as the format requires, within the size limit.

    Raises:
        MeshError: not a zip file, or an entry that is compressed, encrypted, overlapping, a package itself, or named
            outside the package.
    """
    try:
        with zipfile.ZipFile(path) as package:
            entries = package.infolist()
    except (zipfile.BadZipFile, ValueError, NotImplementedError, UnicodeDecodeError, OSError) as error:
        raise MeshError(path, f"not a usdz package ({printable(error, 120)}); export it again") from None
    if not 0 < len(entries) <= MAX_ENTRIES:
        raise MeshError(path, f"holds {len(entries)} files, expected 1 to {MAX_ENTRIES}; package the model alone")
    for entry in entries:
        name = printable(entry.filename, 120)
        inside = PurePosixPath(entry.filename.replace("\\", "/"))
        if inside.is_absolute() or ".." in inside.parts or ":" in entry.filename:
            raise MeshError(path, f"names the file {name!r}, outside the package; package the model again")
        if entry.compress_type != zipfile.ZIP_STORED or entry.compress_size != entry.file_size:
            grown = f"{entry.compress_size} bytes that unpack to {entry.file_size}"
            raise MeshError(path, f"its {name!r} is compressed ({grown}); usdz stores files as they are: repack it")
        if entry.flag_bits & 0x1:
            raise MeshError(path, f"its {name!r} is encrypted; package the model without a password")
        if inside.suffix.lower() in (".usdz", ".zip"):
            raise MeshError(path, f"holds the package {name!r}, which is not opened; package the model flat")
    total = sum(entry.file_size for entry in entries)
    if total > min(limits.bytes, path.stat().st_size):
        most = min(limits.bytes, path.stat().st_size)
        raise MeshError(path, f"its files claim {total} bytes, expected at most {most}; it may be a zip bomb")


MATERIALS = ".mtlx"
"""Suffix of MaterialX files: they hold looks and no geometry, and not every build of OpenUSD reads them."""


def check_layers(path: Path, limits: MeshLimits) -> tuple[Any, ...]:
    """Follow sublayers, references and payloads from a USD file, in every variant, and check each file met.

    References to MaterialX files are removed from the layers in memory.

    Returns:
        The layers; the removals last as long as they are held.

    Raises:
        MeshError: a file that is missing, unreadable or outside the first one's folder; value clips; or too many
            files or bytes.
    """
    folder = path.resolve().parent
    waiting, visited, total = [str(path.resolve())], set[str](), 0
    layers: list[Any] = []
    while waiting:
        identifier = waiting.pop()
        if identifier in visited:
            continue
        visited.add(identifier)
        package, _, _ = identifier.partition("[")
        if package not in visited or package == identifier:
            total += _check_file(path, Path(package), limits)
        if len(visited) > limits.layers or total > limits.bytes:
            most = f"{limits.layers} files and {limits.bytes} bytes"
            raise MeshError(path, f"is composed of more than {most}; flatten the stage and simplify its meshes")
        layer = open_layer(path, identifier)
        if _has_clips(layer):
            raise MeshError(path, "uses value clips, which are not read; flatten the stage at one time")
        layers.append(layer)
        for reference in layer.GetCompositionAssetDependencies():
            if Path(reference).suffix.lower() == MATERIALS:
                layer.UpdateCompositionAssetDependency(reference, "")
            elif reference:  # an empty path is a reference within the layer
                waiting.append(_target(path, folder, layer, reference))
    return tuple(layers)


def open_layer(path: Path, identifier: str) -> Any:
    """Return a layer of the stage at `path`.

    Raises:
        MeshError: it cannot be read as USD.
    """
    from pxr import Sdf, Tf

    try:
        layer = Sdf.Layer.FindOrOpen(identifier)
    except Tf.ErrorException as error:
        raise MeshError(path, f"cannot be read as USD ({diagnostics(error)}); export it again") from None
    if layer is None:
        raise MeshError(path, f"{Path(identifier).name} cannot be read as USD; export it again")
    return layer


def diagnostics(error: Any) -> str:
    """Return the error messages of USD's C++ library in one bounded line."""
    texts = [str(getattr(item, "commentary", item)) for item in error.args] or [str(error)]
    return printable(texts[0], 200)


def _target(path: Path, folder: Path, layer: Any, reference: str) -> str:
    """Return the identifier of the layer that a reference in `layer` means."""
    from pxr import Sdf

    shown = printable(reference, 120)
    if "`" in reference or ":SDF_FORMAT_ARGS:" in reference:
        raise MeshError(path, f"references {shown!r} by an expression, which is not evaluated; flatten the stage")
    identifier = Sdf.ComputeAssetPathRelativeToLayer(layer, reference)
    package, bracket, inside = identifier.partition("[")
    file = Path(package)
    if not file.is_absolute():
        file = Path(layer.realPath.partition("[")[0]).parent / package
    if "://" in reference or not file.resolve().is_relative_to(folder):
        raise MeshError(path, f"references {shown!r} outside its folder; put all its files in one folder")
    if not file.is_file():
        raise MeshError(
            path, f"references {shown!r}, which is missing; put it into the folder of the file or flatten the stage"
        )
    return f"{file}{bracket}{inside}"


def _check_file(path: Path, file: Path, limits: MeshLimits) -> int:
    """Return a file's size after checking its package directory."""
    if not file.is_file():
        raise MeshError(path, f"{file.name} is not a regular file")
    if file.suffix.lower() == ".usdz":
        try:
            check_package(file, limits)
        except MeshError as error:
            raise MeshError(
                path, error.problem if file == path.resolve() else f"{file.name}: {error.problem}"
            ) from None
    return file.stat().st_size


def _has_clips(layer: Any) -> bool:
    has_clips = False

    def visit(spec_path: Any) -> None:
        nonlocal has_clips
        spec = layer.GetObjectAtPath(spec_path)
        has_clips = has_clips or (spec_path.IsPrimPath() and spec is not None and spec.HasInfo("clips"))

    layer.Traverse("/", visit)
    return has_clips
