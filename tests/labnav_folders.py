"""Folders of LabNav evaluations whose scores are made up, on published episodes."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes
from labgym.eval.driving.episode_row import LabNavRow, Track
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.labnav.summary import summarise

ScoreOf = Callable[[LabNavEpisodes, LabNavEpisode], float]
RouteOf = Callable[[LabNavEpisode], Sequence[Sequence[float]]]


def made_up_row(part: LabNavEpisodes, episode: LabNavEpisode, policy: str, track: Track, score: float) -> LabNavRow:
    """Return a row of a drive that succeeds if its score is above 0 and ends at person 3 otherwise."""
    return LabNavRow(
        suite=part.label,
        task=part.task,
        level=part.level,
        floor=episode.floor,
        floor_hash=episode.floor_hash,
        number=episode.number,
        policy=policy,
        track=track,
        seed=0,
        score=score,
        success=score > 0.0,
        ending="success" if score else "contact",
        contact="" if score else "person 3",
        shortest=episode.length,
        straight=5.0,
        path_length=10.0,
        time=12.0,
        final_distance=0.1,
        final_heading=0.0,
        odometry_error=0.0,
        steps=120,
        contacts=0 if score else 4,
        outcomes={"people": {"met": 2}} if part.task == "people" else {},
    )


def line_to_goal(episode: LabNavEpisode) -> list[list[float]]:
    """Return a route straight from the start to the goal at 1 m/s."""
    (x0, y0, yaw), (x1, y1, _) = episode.start, episode.goal
    count = max(2, round(episode.length * 10))
    return [[round(x0 + (x1 - x0) * k / count, 3), round(y0 + (y1 - y0) * k / count, 3), yaw] for k in range(count + 1)]


def write_folder(
    folder: Path,
    suite: LabNavSuite,
    policy: str,
    track: Track,
    score_of: ScoreOf,
    route_of: RouteOf = lambda _: [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]],
) -> Path:
    """Write the folder of an evaluation and return it."""
    drives = [(part, one) for part in suite.parts for one in part.episodes]
    rows = [made_up_row(part, one, policy, track, score_of(part, one)) for part, one in drives]
    fields = {"options": {}, "sensors": "lidar", "seed": 0, "latency": 0.0}
    summary = summarise(suite, rows, policy=policy, track=track, **fields)
    folder.mkdir()
    routes = [{"key": row.key, "poses": route_of(one)} for row, (_, one) in zip(rows, drives, strict=True)]
    times = [{"key": row.key, "planning_ms": 1.0, "high_ms": 1.5, "slow": False} for row in rows]
    (folder / "summary.json").write_text(json.dumps(summary.to_json()))
    for name, lines in (
        ("episodes.jsonl", [row.model_dump(mode="json") for row in rows]),
        ("routes.jsonl", routes),
        ("times.jsonl", times),
    ):
        (folder / name).write_text("".join(json.dumps(line) + "\n" for line in lines))
    return folder
