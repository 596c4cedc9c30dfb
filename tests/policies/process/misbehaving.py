"""Policies that break in every way, as a user's module: `misbehaving:Misbehaving`."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from labgym.policies import Policy

ACTION = np.array([0.3, 0.1])


def sockets() -> list[int]:
    """Return the descriptors of this process that are sockets."""
    return [
        int(entry.name)
        for entry in Path("/proc/self/fd").iterdir()
        if entry.is_symlink() and str(entry.readlink()).startswith("socket:")
    ]


def daemon() -> None:
    """Leave a process behind that left the session and has no parent."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            time.sleep(100)
        os._exit(0)
    os.wait()


class Honest(Policy):
    def reset(self, episode):
        pass

    def act(self, observation):
        return ACTION


class Misbehaving(Honest):
    """Misbehaves in one episode, in its third step, and is honest in all others."""

    def __init__(self, way: str, goal_x: float, folder: str = "") -> None:
        self.way, self.goal_x, self.folder = way, goal_x, folder
        self.steps = 0

    def reset(self, episode):
        self.bad = abs(episode.goal[0] - self.goal_x) < 1e-6

    def act(self, observation):
        self.steps += 1
        return getattr(self, self.way)() if self.bad and self.steps == 3 else ACTION

    def raises(self):
        raise RuntimeError("no\nthanks")

    def raises_unprintable(self):
        class RudeError(Exception):
            def __str__(self):
                raise ValueError

        raise RudeError

    def interrupts_itself(self):
        raise KeyboardInterrupt

    def system_exit(self):
        sys.exit(7)

    def os_exit(self):
        os._exit(3)

    def kills_itself(self):
        os.kill(os.getpid(), signal.SIGKILL)

    def segfaults(self):
        ctypes.string_at(0)

    def kills_its_parent(self):
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(100)

    def hangs(self):
        while True:
            pass

    def sleeps_deaf(self):
        for number in range(1, 64):
            if number not in (signal.SIGKILL, signal.SIGSTOP, 32, 33):
                signal.signal(number, signal.SIG_IGN)
        time.sleep(1000)

    def eats_memory(self):
        self.memory = [np.ones(1 << 25) for _ in range(100)]
        time.sleep(100)

    def three_numbers(self):
        return np.zeros(3)

    def nothing(self):
        return None

    def text(self):
        return "left"

    def nan(self):
        return np.array([np.nan, 0.0])

    def infinite(self):
        return np.array([1e300, 0.0])

    def many_numbers(self):
        return np.zeros(10_000_000)

    def forks_children(self):
        for _ in range(3):
            daemon()
        raise RuntimeError("forked")

    def closes_its_sockets(self):
        for descriptor in sockets():
            os.close(descriptor)
        time.sleep(100)

    def sends_garbage(self):
        for descriptor in sockets():
            os.write(descriptor, b"garbage" * 100)
        time.sleep(100)

    def sends_nan(self):
        for descriptor in sockets():
            os.write(descriptor, b"A\x08\x00\x00\x00" + np.array([np.nan, 1.0], "<f4").tobytes())
        time.sleep(100)

    def sends_facts(self):
        for descriptor in sockets():
            os.write(descriptor, b"F\x02\x00\x00\x00{}")
        time.sleep(100)

    def sends_a_pickle(self):
        bomb = f"{self.folder}-bomb"

        class Bomb:
            def __reduce__(self):
                return os.system, (f"touch {bomb}",)

        import pickle

        for descriptor in sockets():
            content = pickle.dumps(Bomb())
            os.write(descriptor, b"E" + len(content).to_bytes(4, "little") + content)
        time.sleep(100)


class Printing(Honest):
    def __init__(self):
        print("made")  # noqa: T201

    def reset(self, episode):
        print("reset")  # noqa: T201
        os.write(1, b"raw reset\n")

    def act(self, observation):
        print("act")  # noqa: T201
        subprocess.run(["echo", "program"], check=True)
        return ACTION


class Threaded(Honest):
    """Starts a thread when it is made: its process cannot be forked."""

    def __init__(self) -> None:
        import threading

        self.released = threading.Event()
        threading.Thread(target=self.released.wait, daemon=True).start()
        self.episodes = 0

    def reset(self, episode):
        self.episodes += 1

    def act(self, observation):
        return np.array([0.1 * self.episodes, 0.0])


class SlowToLoad(Honest):
    def __init__(self, seconds: float) -> None:
        time.sleep(seconds)


class DeadOnArrival(Honest):
    def __init__(self) -> None:
        os._exit(5)


class LiarAboutItself(Honest):
    name = "liar"
    observation = "truth"


class Forgetful(Honest):
    """Starts processes and hangs while it loads or in its first step."""

    def __init__(self, hang: str) -> None:
        if hang == "load":
            subprocess.Popen(["sleep", "1000"])
            time.sleep(1000)

    def reset(self, episode):
        daemon()
        subprocess.Popen(["sleep", "1000"])

    def act(self, observation):
        time.sleep(1000)
