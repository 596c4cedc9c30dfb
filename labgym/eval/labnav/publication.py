"""Drawing the suites of LabNav for publication: all tasks and levels on the floors of a split, and their hashes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field

import labgym
from labgym.artefacts import artefacts
from labgym.counts import whole_number
from labgym.documents import Document, Record, json_bytes, write_bytes
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.labnav.episodes import DEVELOPMENT, FOLDER, UNFILTERED, Hash, LabNavEpisodes, Split
from labgym.envs.labnav.tasks import HEADLINE, TASKS, task_of
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.layouts import Layout, load_published, published
from labgym.layouts.sealed import FRESH, SEALED, SECRET_SPLITS, commitment, secret_hash
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards
from labgym.runs.folder import SHARDS

MANIFEST = "suites.json"
SEALED_MANIFEST = "sealed.json"
VERSION = 2
"""Of LabNav's episodes and rules; it rises with every change of a floor, an episode, a sensor stream or a drive."""
ATTEMPTS = 1000
"""Number of drives that are drawn on a floor before the next floor takes its place."""
UNFILTERED_PER_FLOOR = 1
"""Episodes of a floor in the unfiltered suites."""


@dataclass(frozen=True)
class SuiteName:
    """The name of a suite of one task.

    Attributes:
        task, level: of LabNav. filtered: whether its drives have the properties of the level.
    """

    task: str
    level: int
    filtered: bool = True

    def __str__(self) -> str:
        return f"{self.task}-{self.level}" + ("" if self.filtered else f"-{UNFILTERED}")


class SuiteEntry(Record):
    """A suite of a manifest.

    Attributes:
        hash: of its document. episodes: number. floors: that have them. tried: floors on which drives were drawn.
        drawn, accepted: number of drives on these.
    """

    hash: Hash
    episodes: Annotated[int, Field(ge=1)]
    floors: Annotated[int, Field(ge=1)]
    tried: Annotated[int, Field(ge=1)]
    drawn: Annotated[int, Field(ge=1)]
    accepted: Annotated[int, Field(ge=1)]

    @classmethod
    def of(cls, suite: LabNavEpisodes) -> SuiteEntry:
        """Return the entry of a suite."""
        return cls(
            hash=suite.hash,
            episodes=len(suite.episodes),
            floors=len(suite.floors),
            tried=len(suite.draws),
            drawn=sum(each.drawn for each in suite.draws.values()),
            accepted=sum(each.accepted for each in suite.draws.values()),
        )


class LabNavManifest(Document):
    """The hashes of LabNav's suites: `eval/labnav/suites.json`, and `sealed.json` for those that are not public.

    Attributes:
        version: of episodes and rules. draft: whether they may still change. labgym: version that drew them.
        split: of the floors. secret: SHA-256 of the secret of sealed or fresh suites; None for public ones.
        suites: by name without "labnav-".
    """

    SCHEMA: ClassVar[str] = "labgym.labnav-manifest/1"

    version: Annotated[int, Field(ge=0)]
    draft: bool
    labgym: Annotated[str, Field(max_length=100)]
    split: Split
    secret: Hash | None = None
    suites: Annotated[dict[str, SuiteEntry], Field(min_length=1, max_length=100)]

    def differences(self, other: LabNavManifest) -> tuple[str, ...]:
        """Return a sentence for each difference of other suites, drawn with a secret, from these."""
        problems = []
        if self.secret != other.secret:
            problems.append("the secret has another SHA-256 than the published one")
        if self.version != other.version:
            problems.append(f"version {other.version}, published {self.version}")
        for name in sorted({*self.suites, *other.suites}):
            own, drawn = self.suites.get(name), other.suites.get(name)
            if own is None or drawn is None:
                problems.append(f"{FOLDER}-{name}: " + ("not published" if own is None else "not drawn"))
            elif own.hash != drawn.hash:
                problems.append(f"{FOLDER}-{name}: hash {drawn.hash[:12]}, published {own.hash[:12]}")
        return tuple(problems)


@dataclass(frozen=True)
class Publication:
    """The arguments of a draw.

    Attributes:
        split: of the floors. floors: greatest number of them. per_floor: episodes of a task and level on each.
        tasks, levels: which ones. unfiltered: whether the headline's level has unfiltered suites, too.
        version: of the suites. draft: whether they may still change.
        seed: random seed of the draw; of sealed and fresh suites, the secret decides.
        secret: 32 bytes; None for public splits.
        layouts: folder of the floors of a split with a secret.
        attempts: greatest number of drives that are drawn on a floor.
    """

    split: Split
    floors: int = 60
    per_floor: int = 2
    tasks: tuple[str, ...] = tuple(TASKS)
    levels: tuple[int, ...] = (1, 2, 3)
    unfiltered: bool = True
    version: int = VERSION
    draft: bool = False
    seed: int = 14
    secret: bytes | None = None
    layouts: Path | None = None
    attempts: int = ATTEMPTS

    def __post_init__(self) -> None:
        """Check the fields.

        Raises:
            UnknownNameError: a task or a level does not exist.
            OptionError: a number is out of range, or the secret or the layouts are missing or not expected.
        """
        for task in self.tasks:
            for level in self.levels:
                task_of(task).level(level)
        for name, value, low, high in (
            ("floors", self.floors, 1, 10_000),
            ("episodes of a floor", self.per_floor, 1, 100),
            ("version", self.version, 0, 10_000),
            ("seed", self.seed, 0, 2**53),
            ("attempts", self.attempts, 1, 1_000_000),
        ):
            whole_number(name, value, low, high)
        secret = self.split in SECRET_SPLITS
        if secret != (self.secret is not None) or secret != (self.layouts is not None):
            raise OptionError(
                f"split {self.split!r}: the suites of {' and '.join(SECRET_SPLITS)} need a secret (--secret-file) and "
                "the folder of their floors (--layouts), which labgym floors writes; the others need neither"
            )

    @property
    def names(self) -> tuple[SuiteName, ...]:
        """The suites."""
        filtered = [SuiteName(task, level) for task in self.tasks for level in self.levels]
        # A shift is drawn without a filter of difficulty.
        tasks = self.tasks if self.unfiltered and HEADLINE in self.levels else ()
        return (*filtered, *(SuiteName(task, HEADLINE, False) for task in tasks if not task_of(task).chain))

    @property
    def floor_names(self) -> tuple[str, ...]:
        """The ids of the split's floors.

        Raises:
            LabgymError: the sealed split has no published commitment, or the folder of fresh floors is empty.
        """
        if self.split == FRESH and self.layouts is not None:
            names = tuple(sorted(path.stem for path in self.layouts.glob(f"{FRESH}-*.json")))
            if not names:
                raise LabgymError(f"{self.layouts} holds no floors of {FRESH}: draw them with labgym floors first")
            return names
        if self.split != SEALED:
            return published(self.split)
        committed = commitment()
        if committed is None:
            raise LabgymError(f"no commitment to {SEALED} is published: draw its floors with labgym floors first")
        return tuple(floor.id for floor in committed.floors)

    def seed_of(self, name: SuiteName) -> int:
        """Return the random seed of a suite's draw: with a secret, the SHA-256 of the secret and the name."""
        if self.secret is None:
            return self.seed
        digest = hashlib.sha256(self.secret + f":{FOLDER}:{name}".encode()).digest()
        return int.from_bytes(digest, "big") % 2**53

    @property
    def identity(self) -> RunIdentity:
        """Identity of the draw: all that its files depend on."""
        return RunIdentity.of(
            "labnav-suites",
            split=self.split,
            floors=self.floors,
            per_floor=self.per_floor,
            suites=[str(name) for name in self.names],
            version=self.version,
            draft=self.draft,
            seed=self.seed,
            secret=None if self.secret is None else secret_hash(self.secret),
            attempts=self.attempts,
        )


def draw_suites(
    publication: Publication,
    out: str | Path,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
) -> LabNavManifest:
    """Draw suites into a folder, with their manifest, and return it.

    An interrupted call resumes; the files do not depend on the executor. A floor without enough episodes of a suite is
    left out of it, and the next floor of the split takes its place; a suite has fewer floors if the split has no more.

    Args:
        publication: what to draw. out: the folder.
        executor: where floors are drawn. fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.

    Raises:
        OptionError: the folder holds something else.
        LabgymError: no floor has enough episodes of a suite, or workers died.
    """
    with RunFolder.open(out, publication.identity, fresh) as folder:
        if folder.finished:
            return LabNavManifest.load(folder.path / MANIFEST)
        suites = _drawn(publication, folder, executor or ExecutorOptions(), progress)
        manifest = LabNavManifest(
            version=publication.version,
            draft=publication.draft,
            labgym=labgym.__version__,
            split=publication.split,
            secret=None if publication.secret is None else secret_hash(publication.secret),
            suites={str(name): SuiteEntry.of(suite) for name, suite in suites.items()},
        )
        files = {f"{name}.json": suite.text.encode() for name, suite in suites.items()}
        folder.finish({**files, MANIFEST: json_bytes(manifest.to_json())})
    return manifest


def publish(manifest: LabNavManifest, out: str | Path, folder: str | Path | None = None) -> tuple[Path, ...]:
    """Copy drawn suites and their manifest to the published ones; of sealed suites the manifest alone.

    Args:
        manifest: of the suites in the folder `out`. folder: that receives them; by default eval/labnav, and
            eval/labnav/val for those on floors-val.

    Raises:
        DocumentError: a suite does not have its hash.
        OptionError: the floors are fresh ones, which are published with their round (labgym leaderboard).
    """
    if manifest.split == FRESH:
        raise OptionError(f"suites of {FRESH} are not published: labgym leaderboard --fresh-round publishes the secret")
    own = artefacts("eval") / FOLDER
    target = Path(folder) if folder is not None else own / DEVELOPMENT if manifest.split == "floors-val" else own
    if manifest.split == SEALED:
        return (manifest.save(target / SEALED_MANIFEST),)
    written = []
    for name, entry in manifest.suites.items():
        path = Path(out) / f"{name}.json"
        if LabNavEpisodes.load(path).hash != entry.hash:
            raise DocumentError(path, "episodes", "their hash is not the manifest's: draw them again with --fresh")
        written.append(write_bytes(target / path.name, path.read_bytes()))
    return (*written, manifest.save(target / MANIFEST))


def published_manifest(name: str = MANIFEST) -> LabNavManifest | None:
    """Return the manifest of the published suites, None without one.

    Args:
        name: `SEALED_MANIFEST` for that of the sealed suites, "val/suites.json" for that of floors-val.

    Raises:
        DocumentError: the file is broken.
    """
    path = artefacts("eval") / FOLDER / name
    return LabNavManifest.load(path) if path.is_file() else None


def _drawn(
    publication: Publication, folder: RunFolder, executor: ExecutorOptions, progress: bool
) -> dict[SuiteName, LabNavEpisodes]:
    """Return the suites; floors that lack episodes are replaced by the next ones of the split."""
    floors = publication.floor_names
    results: dict[SuiteName, list[dict[str, Any]]] = {name: [] for name in publication.names}
    while shards := list(_next(publication, floors, results)):
        outputs = {
            shard.name: json.loads(output.files[f"{SHARDS}/{shard.name}.json"])
            for shard, output in run_shards(shards, folder, executor, FOLDER, "floor", progress=progress)
        }
        for shard in shards:
            results[shard.arguments[0]].append(outputs[shard.name])
    return {name: _suite(publication, name, each) for name, each in results.items()}


def _next(
    publication: Publication, floors: Sequence[str], results: Mapping[SuiteName, Sequence[Mapping[str, Any]]]
) -> Iterator[Shard]:
    """Yield the draws that are still needed: for each suite as many floors as it lacks, or as are left."""
    for name, done in results.items():
        count = publication.per_floor if name.filtered else UNFILTERED_PER_FLOOR
        lacking = publication.floors - sum(len(each["episodes"]) == count for each in done)
        for floor in floors[len(done) : len(done) + lacking]:
            # The secret stays here: shards receive the seeds that follow from it.
            draw = count, publication.seed_of(name), publication.attempts
            yield Shard(f"{name}/{floor}", draw_shard, (name, publication.split, floor, publication.layouts, *draw))


def draw_shard(
    name: SuiteName, split: Split, floor: str, layouts: Path | None, count: int, seed: int, attempts: int
) -> ShardOutput:
    """Return the episodes of a suite on one floor, and how many drives were drawn for them.

    Args:
        name: of the suite. split, floor: the floor; layouts: folder of one that follows from a secret.
        count, seed, attempts: as for `labgym.envs.labnav.drawing.draw_floor`.
    """
    layout = load_published(split, floor) if layouts is None else secret_floor(layouts, floor, split)
    episodes, draws = draw_floor(layout, name.task, name.level, count, seed, attempts, name.filtered)
    data = {
        "floor": floor,
        "episodes": [each.model_dump(mode="json") for each in episodes],
        "draws": draws.model_dump(mode="json"),
    }
    return ShardOutput({f"{SHARDS}/{name}/{floor}.json": json.dumps(data).encode()})


def secret_floor(folder: Path, name: str, split: Split) -> Layout:
    """Return a floor of a split with a secret from the folder that `labgym floors` wrote.

    Raises:
        DocumentError: it is missing, or its hash is not that of the published commitment to the sealed split.
    """
    path = folder / f"{name}.json"
    layout = Layout.load(path)
    committed = commitment() if split == SEALED else None
    if committed is not None and layout.hash not in {floor.hash for floor in committed.floors if floor.id == name}:
        raise DocumentError(path, "placements", f"hash {layout.hash[:12]} is not that of the commitment to {SEALED}")
    return layout


def _suite(publication: Publication, name: SuiteName, floors: Iterable[Mapping[str, Any]]) -> LabNavEpisodes:
    """Return a suite from the draws on its floors."""
    floors = list(floors)
    count = publication.per_floor if name.filtered else UNFILTERED_PER_FLOOR
    if not any(len(each["episodes"]) == count for each in floors):
        raise LabgymError(
            f"{FOLDER}-{name}: no floor of {publication.split} has {count} episodes: ask for fewer, or more attempts"
        )
    return LabNavEpisodes.model_validate(
        {
            "task": name.task,
            "level": name.level,
            "version": publication.version,
            "draft": publication.draft,
            "filtered": name.filtered,
            "split": publication.split,
            "seed": publication.seed_of(name),
            "episodes": [one for each in floors if len(each["episodes"]) == count for one in each["episodes"]],
            "draws": {each["floor"]: each["draws"] for each in floors},
        }
    )
