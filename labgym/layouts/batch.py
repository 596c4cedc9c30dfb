"""Many layouts in one folder: protocols by seeds, generated in shards on any executor.

A folder of a batch holds `rows.jsonl`, one row for each protocol and seed in their order, and the layout files below
`layouts/`, `PER_FOLDER` to a subfolder.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from labgym.assets import Catalog
from labgym.counts import MAX_SEED, whole_number
from labgym.documents import Record, canonical_hash, json_bytes, read_json, validating
from labgym.errors import DocumentError, InfeasibleError, OptionError, SearchLimitError, UnrepairedError
from labgym.layouts.floor import IDENTIFIER, Room
from labgym.layouts.generate import FURNISHER, GENERATOR, generate_assessed, resolve_request
from labgym.layouts.method import DEFAULT, Method
from labgym.layouts.model import Layout
from labgym.layouts.request import Request, check_named_once
from labgym.layouts.rules.rule_sets import TOUCHSTONE, RuleSet
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.sites import at_seed
from labgym.llm import LanguageModelConfig
from labgym.protocols import Protocol
from labgym.protocols import protocols as library
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards
from labgym.runs.identity import IDENTITY_FILE

KIND = "generate"
ROWS = "rows.jsonl"
PER_FOLDER = 1000
"""Most layout files in a subfolder: a million layouts take a thousand subfolders."""
PER_SHARD = 20
"""Default number of layouts in a shard: about 7 s of work, of which a kill costs at most one shard per worker."""
ALL = "all"
"""In place of protocols: the whole library."""
FITNESS_DIGITS = 6

Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class BatchRow(Record):
    """A protocol and a seed, with the layout that was generated or the reason why it could not be.

    Attributes:
        protocol: id of the protocol.
        seed: random seed.
        room: name of the room.
        file: path of the layout relative to the batch's folder; null without a layout, like all that follows.
        hash: of the layout.
        v: number of violations.
        objects: number of placements.
        fitness: F in [0, 1], rounded to six decimals.
        furnishing: full, reduced or required.
        clutter: level of loose objects.
        infeasible: why no layout was generated; null if one was.
        proven: whether the room cannot hold the protocol; false if the search stopped at its effort limit, or if a
            proposal could not be repaired.
        facility, missing: numbers of facility errors and of missing assets; only in batches that keep layouts with
            violations.
    """

    protocol: str
    seed: int
    room: str
    file: str | None = None
    hash: Digest | None = None
    v: int | None = None
    objects: int | None = None
    fitness: float | None = None
    furnishing: str | None = None
    clutter: int | None = None
    infeasible: str | None = None
    proven: bool | None = None
    facility: int | None = None
    missing: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the row as plain data; `facility` and `missing` only if they are numbers."""
        kept = self.facility is not None
        return self.model_dump(mode="json", exclude=set() if kept else {"facility", "missing"})


@dataclass(frozen=True)
class LayoutBatch:
    """A finished batch.

    Attributes:
        folder: its folder.
        layouts: number of layouts.
        infeasible: number of rows without a layout.
        failing: number of layouts that were kept although they violate rules or lack required assets.
    """

    folder: Path
    layouts: int
    infeasible: int
    failing: int = 0

    @property
    def summary(self) -> str:
        """One sentence on how many layouts there are."""
        total = self.layouts + self.infeasible
        failing = f", {self.failing} kept with violations" if self.failing else ""
        return f"{self.layouts} of {total} layouts generated{failing}, {self.infeasible} infeasible (reasons in {ROWS})"


def generate_batch(
    protocols: Sequence[Protocol | str | Path] | str,
    count: int,
    out: str | Path,
    *,
    seed: int = 0,
    room: Room | str | Path | None = None,
    profile: str | Profile | None = None,
    catalog: Catalog | None = None,
    shard: int = PER_SHARD,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
    family: str | None = None,
    clutter: int = 0,
    method: Method = DEFAULT,
    rules: str | RuleSet = TOUCHSTONE,
) -> LayoutBatch:
    """Generate `count` layouts of each protocol, with the seeds from `seed` on, and write them into a folder.

    Row i is about protocol i // count and seed `seed + i % count`. The files depend on the arguments alone, not on the
    executor, and an interrupted batch resumes.

    Args:
        protocols: protocols, their ids or their .json files; "all" for the library.
        count: number of layouts of each protocol.
        out: folder of the batch.
        seed: first seed.
        room, profile, catalog, rules: as `generate`.
        shard: number of layouts in a shard, the unit of work that is resumed, lost and sent to workers.
        executor: where the shards run.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.
        family: name of a family of floors, in place of a room; each seed draws a floor.
        clutter: level of loose objects, 0 to 3.
        method: how each layout is made; its proposer and adjuster are names.

    Raises:
        UnknownNameError: no such protocol, room preset, family or profile.
        OptionError: a count, seed, level of clutter or shard size out of range, a protocol named twice, an object in
            place of the name of a proposer or an adjuster, or the folder holds something else or is in use.
        LabgymError: workers died, or have another version of labgym or another catalog.
    """
    whole_number("count", count)
    whole_number("shard", shard, most=PER_FOLDER)
    if not (isinstance(method.proposer, str) and isinstance(method.adjuster, str)):
        raise OptionError("a batch needs the names of its proposer and adjuster, which identify it; got an object")
    requests = [
        resolve_request(protocol, seed, room, profile, catalog, (), family=family, clutter=clutter, rules=rules)
        for protocol in _resolved(protocols)
    ]
    _check(requests, count)
    shards = tuple(_shards(requests, count, shard, method))
    with RunFolder.open(out, _identity(requests, count, shard, method), fresh) as folder:
        if not folder.finished:
            digests = {"catalog": catalog_digest} if catalog is None else {}
            for _ in run_shards(shards, folder, executor, "layouts", "layout", digests, progress=progress):
                pass
            parts = (folder.path / _part(index) for index in range(len(shards)))
            folder.finish({ROWS: (part.read_bytes() for part in parts)})
    infeasible = failing = 0
    for row in read_rows(out):
        infeasible += row.infeasible is not None
        failing += bool(row.v or row.facility or row.missing)
    return LayoutBatch(Path(out), len(requests) * count - infeasible, infeasible, failing)


def read_rows(folder: str | Path) -> Iterator[BatchRow]:
    """Yield the rows of a batch in their order.

    Raises:
        OptionError: the folder holds no batch, or an unfinished one.
        DocumentError: a row is broken; names its line.
    """
    path = Path(folder) / ROWS
    if not path.is_file():
        raise OptionError(f"{folder} holds no finished batch of layouts: {ROWS} is missing; run labgym generate again")
    with path.open("rb") as stream:
        for number, line in enumerate(stream, start=1):
            with validating(f"{path}:{number}"):
                row = BatchRow.model_validate_json(line)
            yield row


def load_layout(folder: str | Path, row: BatchRow, catalog: Catalog | None = None) -> Layout | None:
    """Return the layout of a row; None for an infeasible one.

    Raises:
        DocumentError: the file is missing or broken, or its hash is not the row's.
    """
    if row.file is None:
        return None
    path = Path(folder) / row.file
    layout = Layout.load(path, catalog)
    if layout.hash != row.hash:
        raise DocumentError(path, "", f"its hash is {layout.hash[:12]}, but {ROWS} says {str(row.hash)[:12]}")
    return layout


def folder_layouts(folder: str | Path, catalog: Catalog | None = None) -> Iterator[Layout]:
    """Yield the layouts of a folder: those of a batch in the order of its rows, else all files, subfolders included.

    Other documents of labgym in the folder, such as manifests, are skipped.

    Raises:
        OptionError: the folder has no layout, or it holds an unfinished batch.
        DocumentError: a file is missing, broken, not a layout, or does not have the hash of its row.
    """
    folder = Path(folder)
    empty = True
    for layout in _of_batch(folder, catalog) if _is_batch(folder) else _of_files(folder, catalog):
        empty = False
        yield layout
    if empty:
        raise OptionError(f"{folder} has no layout; name a folder of layouts, such as labgym generate --count writes")


def _is_batch(folder: Path) -> bool:
    identity = folder / IDENTITY_FILE
    return (folder / ROWS).is_file() or (identity.is_file() and RunIdentity.load(identity).kind == KIND)


def _of_batch(folder: Path, catalog: Catalog | None) -> Iterator[Layout]:
    return (layout for row in read_rows(folder) if (layout := load_layout(folder, row, catalog)) is not None)


def _of_files(folder: Path, catalog: Catalog | None) -> Iterator[Layout]:
    for path in sorted(folder.rglob("*.json")):
        data = read_json(path)
        schema = str(data.get("schema", "")) if isinstance(data, dict) else ""
        if schema.startswith("labgym.layout/") or not schema.startswith("labgym."):
            yield Layout.parse(data, path, catalog)


def _resolved(chosen: Sequence[Protocol | str | Path] | str) -> list[Protocol | str | Path]:
    if chosen == ALL or (not isinstance(chosen, str) and list(chosen) == [ALL]):
        return list(library().values())
    return [chosen] if isinstance(chosen, str) else list(chosen)


def _check(requests: list[Request], count: int) -> None:
    """Check what can be checked before the first layout is generated."""
    if not requests:
        raise OptionError(f"no protocol; name at least one, or {ALL!r}")
    check_named_once([request.protocol.id for request in requests])
    last = requests[0].seed + count - 1
    if last > MAX_SEED:
        raise OptionError(f"the last seed is {last}, expected at most {MAX_SEED}")
    for request in requests:
        longest = f"{request.protocol.id}-{request.floor.name}-{last}"
        if re.match(IDENTIFIER, longest) is None:
            raise OptionError(
                f"{longest!r} cannot be a layout's name (letters, digits, '_', '.', '-', at most 80): rename the room"
            )


def _identity(requests: list[Request], count: int, shard: int, method: Method) -> RunIdentity:
    first = requests[0]
    return RunIdentity.of(
        KIND,
        protocols={request.protocol.id: canonical_hash(request.protocol.to_json()) for request in requests},
        count=count,
        seed=first.seed,
        room=_place(first),
        profile=first.profile.name,
        rules=first.rules.name,
        catalog=first.catalog.digest,
        generator=GENERATOR,
        shard=shard,
        **({"clutter": first.clutter} if first.clutter else {}),
        **({"method": method.options} if method.options else {}),
        **({"model": LanguageModelConfig.from_environment().model} if method.asks_model else {}),
    )


def _place(request: Request) -> Any:
    """Return the data on which the floors of a batch depend."""
    if request.family:
        return {"family": request.family, "furnisher": FURNISHER}
    return {"floor": request.floor.model_dump(mode="json"), "furnisher": FURNISHER}


def _shards(requests: list[Request], count: int, size: int, method: Method) -> Iterator[Shard]:
    """Yield the shards; one may cover the end of a protocol and the beginning of the next."""
    total = len(requests) * count
    for index, first in enumerate(range(0, total, size)):
        positions = range(first, min(first + size, total))
        owners = range(positions[0] // count, positions[-1] // count + 1)
        arguments = (index, positions, count, {owner: requests[owner] for owner in owners}, method)
        yield Shard(f"{index:06d}", make_shard, arguments, len(positions))


def make_shard(
    index: int, positions: range, count: int, requests: dict[int, Request], method: Method = DEFAULT
) -> ShardOutput:
    """Return the files of the layouts at some positions of a batch, and their rows.

    Args:
        index: number of the shard.
        positions: positions in the batch.
        count: number of layouts of each protocol.
        requests: request with the first seed, by number of the protocol.
        method: how each layout is made.
    """
    files: dict[str, bytes] = {}
    rows = []
    for position in positions:
        request = requests[position // count]
        row, content = _generated(at_seed(request, request.seed + position % count), position, method)
        rows.append(row)
        if row.file is not None:
            files[row.file] = content
    lines = (json.dumps(row.to_json(), ensure_ascii=False, allow_nan=False) for row in rows)
    return ShardOutput({**files, _part(index): "".join(f"{line}\n" for line in lines).encode()})


def _generated(request: Request, position: int, method: Method) -> tuple[BatchRow, bytes]:
    basis: dict[str, Any] = {"protocol": request.protocol.id, "seed": request.seed, "room": request.floor.name}
    try:
        layout, assessment = generate_assessed(request, method)
    except InfeasibleError as error:
        proven = not isinstance(error, SearchLimitError | UnrepairedError)
        return BatchRow(**basis, infeasible=str(error), proven=proven), b""
    row = BatchRow(
        **basis,
        file=f"layouts/{position // PER_FOLDER:04d}/{layout.id}.json",
        hash=layout.hash,
        v=assessment.v,
        objects=len(layout.placements),
        fitness=round(assessment.fitness, FITNESS_DIGITS),
        furnishing=layout.provenance.options.get("furnishing"),
        clutter=request.clutter,
        facility=len(assessment.errors) if method.on_failure == "keep" else None,
        missing=len(assessment.missing or ()) if method.on_failure == "keep" else None,
    )
    return row, json_bytes(layout.to_json())


def _part(index: int) -> str:
    return f"shards/{index:06d}.jsonl"


def catalog_digest() -> str:
    """Return the digest of the catalog that this process generates layouts from: guards workers of a run."""
    return Catalog.load().digest
