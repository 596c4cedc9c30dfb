"""Policies that try their box, as a user's module: `hostile:Noting`."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import time
from pathlib import Path
from typing import Any

import probes

from labgym.policies import EpisodeStart, Policy
from labgym.policies.process import loader


class Noting(Policy):
    """Reads the notes of earlier episodes and leaves its own."""

    def __init__(self, folder: str) -> None:
        self.notes = probes.Notes(folder)
        (Path(folder) / "table.json").read_text()  # of its identity, so that it may be read while it drives

    def reset(self, episode: EpisodeStart) -> None:
        notes = self.notes.read()
        self.notes.leave()
        if notes:
            raise RuntimeError(f"notes {notes}")

    def act(self, observation: object) -> list[float]:
        return [0.5, 0.0]


class Plain(Noting):
    def __init__(self) -> None:
        pass

    def reset(self, episode: EpisodeStart) -> None:
        pass


class LookingUp(Noting):
    def __init__(self) -> None:
        pass

    def reset(self, episode: EpisodeStart) -> None:
        from labgym.layouts import load_published, published

        load_published("test", published("test")[0])


class TwoFaced(Noting):
    """Declares another sensor at each load."""

    def __init__(self) -> None:
        self.observation = "lidar" if os.getpid() % 2 else "depth"

    def reset(self, episode: EpisodeStart) -> None:
        pass


class Telling(Plain):
    def reset(self, episode: EpisodeStart) -> None:
        Path(os.environ["TMPDIR"], "note").write_text("x")
        raise RuntimeError(os.environ["TMPDIR"])


class Planning(Plain):
    """Has a path, other kinds of goals, and counts its episodes."""

    goal_kinds = ("point", "none")
    episodes = 0

    def reset(self, episode: EpisodeStart) -> None:
        self.episodes += 1

    def stop(self, observation: object) -> bool:
        return self.episodes == 3

    def act(self, observation: object) -> list[float]:
        return [0.1 * self.episodes, 0.0]

    def planned_path(self) -> list[list[float]] | None:
        return [[0.0, 0.0], [1.0, 0.5]] if self.episodes == 2 else None


class Forging(Plain):
    """Takes over the protocol of its loader, so that one process would serve all episodes."""

    episodes = 0

    def __init__(self) -> None:
        facts_of = loader.facts_of

        def forged(*arguments: Any) -> Any:
            return facts_of(*arguments).model_copy(update={"single_use": False})

        def serve(link: socket.socket, policy: Policy, reads: Any, *rest: Any) -> None:
            while True:
                descriptor = loader.receive_request(link)[2]
                if descriptor is not None:
                    with socket.socket(fileno=descriptor) as conversation:
                        loader.serve_episode(policy, reads, conversation, rest[-1])

        loader.facts_of, loader._serve_episodes = forged, serve  # type: ignore[assignment]

    def reset(self, episode: EpisodeStart) -> None:
        self.episodes += 1
        if self.episodes > 1:
            raise RuntimeError("an earlier episode")


class Chasing(Plain):
    """Leaves a process that starts another and exits, again and again, faster than anybody finds it."""

    def reset(self, episode: EpisodeStart) -> None:
        if os.fork():
            return
        os.setsid()
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        end = time.monotonic() + 60.0
        while time.monotonic() < end:
            if os.fork():
                os._exit(0)


class Failing(Plain):
    """Fails, prints for the terminal, and tells whether it sees that an earlier episode failed."""

    def reset(self, episode: EpisodeStart) -> None:
        frame, printed = sys._getframe(), b""
        while frame is not None:
            printed = bytes(frame.f_locals.get("printed", printed))
            frame = frame.f_back  # type: ignore[assignment]
        sys.stderr.write("\x1b]0;title\x07seen\n")
        raise RuntimeError(f"printed {printed!r}")


class Confiding(Plain):
    """Tells which secrets it has in its environment, now and when its process began."""

    def reset(self, episode: EpisodeStart) -> None:
        texts = (*os.environ.values(), Path("/proc/self/environ").read_text(errors="replace"))
        raise RuntimeError(f"knows {any('labgym-secret' in text for text in texts)}")


class Opening(Plain):
    """Reads a file when it is loaded, unless that is denied."""

    def __init__(self, path: str) -> None:
        with contextlib.suppress(OSError):
            self.name = Path(__file__).parent.joinpath(path).read_text()
