"""The files that a USD stage is composed of: found and checked before the stage is composed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from labgym.assets.meshes.model import Limits, MeshError, printable
from labgym.assets.meshes.packages import check_package

MATERIALS = ".mtlx"
"""Suffix of MaterialX files: they hold looks and no geometry, and not every build of OpenUSD reads them."""


def check_layers(path: Path, limits: Limits) -> tuple[Any, ...]:
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


def _check_file(path: Path, file: Path, limits: Limits) -> int:
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
