"""Policies that look for the simulation, the layout or an earlier episode, as a user's module: `cheats:Searching`.

Each reports its loot by raising `LootError`; without loot it drives like `Honest`.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import hashlib
import os
import sys
from pathlib import Path

import numpy as np

from labgym.policies import Policy

WANTED = ("LabPointNavEnv", "Layout", "GoalPair", "Simulation", "ShortestPaths", "World", "Episode")
"""Classes whose instances hold the layout, the pose or the goal in the room frame."""
MARK = "labgym-test-mark"


class LootError(Exception):
    pass


class Honest(Policy):
    def reset(self, episode):
        self.look(episode)

    def look(self, episode):
        pass

    def act(self, observation):
        return np.array([0.3, 0.1])


class Searching(Honest):
    """Searches all objects of its process."""

    def look(self, episode):
        loot = sorted({type(each).__name__ for each in gc.get_objects()} & set(WANTED))
        if loot:
            raise LootError(f"objects {loot}")


class Climbing(Honest):
    """Searches the local variables of its callers."""

    def look(self, episode):
        frame = sys._getframe()
        while frame is not None:
            for value in frame.f_locals.values():
                names = {
                    type(value).__name__,
                    *(type(each).__name__ for each in getattr(value, "__dict__", {}).values()),
                }
                if names & set(WANTED):
                    raise LootError(f"variables {sorted(names & set(WANTED))}")
            frame = frame.f_back


class Recognizing(Honest):
    """Compares its random generator with those of all published layouts and pairs."""

    def look(self, episode):
        from labgym.errors import DocumentError

        with contextlib.suppress(DocumentError):  # denied in the box
            self.compare(episode.rng)

    def compare(self, rng):
        from labgym.layouts import load_published, published
        from labgym.navigation import goal_pairs

        seeds = rng.bit_generator.seed_seq
        for split in ("val", "test"):
            for layout in (load_published(split, name) for name in published(split)[:3]):
                prints = {int(layout.hash[: 2 * size], 16) for size in (1, 2, 4, 8, 16, 32)}
                prints |= {int.from_bytes(hashlib.sha256(layout.id.encode()).digest()[:size]) for size in (4, 8)}
                words = set(np.ravel(seeds.entropy).tolist()) | set(seeds.spawn_key)
                if any(one in words for one in prints if one > 1 << 16):
                    raise LootError(f"layout {layout.id}")
                for pair in range(len(goal_pairs(layout))):
                    entropies = ([0, int(layout.hash[:16], 16), pair], [0, int(layout.hash, 16), pair])
                    for entropy in (*entropies, *([*each, 0] for each in entropies)):
                        state = np.random.default_rng(entropy).bit_generator.state
                        if state == rng.bit_generator.state:
                            raise LootError(f"layout {layout.id}, pair {pair}")


class Patching(Honest):
    """Replaces the metrics and the rules."""

    def look(self, episode):
        import labgym.eval.driving.drive as drive

        drive.spl = lambda *_: 1.0
        drive.soft_spl = lambda *_: 1.0
        drive.TransitionTask.over = lambda *_: True


class Teleporting(Honest):
    """Puts the robot at its goal."""

    def look(self, episode):
        for each in gc.get_objects():
            if type(each).__name__ == "LabPointNavEnv" and each._episode is not None:
                each._episode.simulation.place(each._episode.task.pair.goal)


class Reading(Honest):
    """Reads the memory, the environment and the descriptors of its ancestors, and its own."""

    def look(self, episode):
        loot = []
        for entry in Path("/proc/self/fd").iterdir():
            kind = str(entry.readlink()) if entry.is_symlink() else ""
            if kind and int(entry.name) > 2 and not kind.startswith(("socket:", "/proc/")):
                loot.append(kind)
        if MARK in " ".join([*sys.argv, *os.environ.values(), Path("/proc/self/cmdline").read_text()]):
            loot.append("own environment")
        pid = os.getpid()
        while (pid := self.parent(pid)) > 1:
            if not self.is_of_labgym(pid):
                break
            for name in ("mem", "environ", "maps", "fd/0", "cwd/."):
                try:
                    os.close(os.open(f"/proc/{pid}/{name}", os.O_RDONLY))
                except OSError:
                    continue
                loot.append(f"{name} of {pid}")
            if ctypes.CDLL(None).ptrace(0x4206, pid, None, None) == 0:  # PTRACE_SEIZE
                loot.append(f"ptrace of {pid}")
        if loot:
            raise LootError(", ".join(loot))

    @staticmethod
    def parent(pid: int) -> int:
        try:
            return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
        except PermissionError:  # in the box
            return 0 if pid != os.getpid() else os.getppid()

    @staticmethod
    def is_of_labgym(pid: int) -> bool:
        """The evaluator's ancestors, such as a shell, know nothing and are not guarded."""
        try:
            command = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
        except PermissionError:  # in the box
            return True
        return pid == int(os.environ.get("LABGYM_TEST_EVALUATOR", "0")) or any(
            part.endswith(b"policies/process/__main__.py") for part in command
        )


memory: list[int] = []


class Remembering(Honest):
    """Remembers earlier episodes in its object, its class, its module and another module."""

    episodes = 0

    def __init__(self):
        self.starts = []

    def look(self, episode):
        earlier = bool(self.starts or memory or type(self).episodes or hasattr(np, "memory"))
        self.starts.append(episode.goal)
        memory.append(1)
        type(self).episodes += 1
        np.memory = 1
        if earlier:
            raise LootError("an earlier episode")
