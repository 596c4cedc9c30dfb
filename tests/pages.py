"""Blocks of documentation pages, executed as they stand, apart from smaller numbers."""

from __future__ import annotations

import os
import re
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from labgym.cli import main

BLOCK = re.compile(r"^```(python|bash)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"\A# (\w+\.py)\n")
"""First line of a block that the reader saves under that name."""
Smaller = Iterable[tuple[str, str]]


def blocks(text: str) -> list[tuple[str, str]]:
    """Return language and code of the fenced blocks of a page that run, in their order."""
    return BLOCK.findall(text)


def smaller(code: str, changes: Smaller) -> str:
    """Return code with large numbers replaced by small ones."""
    for large, small in changes:
        code = code.replace(large, small)
    return code


def run_python(code: str, folder: Path, names: dict[str, Any]) -> None:
    """Run a block in a namespace, or save it if its first line names a file."""
    name = FILE.match(code)
    script = folder / (name[1] if name else "snippet.py")
    script.write_text(code)
    if not name:
        exec(compile(code, str(script), "exec"), names)


@contextmanager
def shell(monkeypatch: pytest.MonkeyPatch, folder: Path) -> Iterator[Shell]:
    """Yield a shell whose background processes end with the block."""
    terminal = Shell(monkeypatch, folder)
    try:
        yield terminal
    finally:
        terminal.close()


class Shell:
    """Runs lines of bash: commands of labgym in this process, variables in its environment, others as they are."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
        self._monkeypatch, self._folder = monkeypatch, folder
        self._background: list[subprocess.Popen[bytes]] = []
        monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")

    def run(self, code: str) -> None:
        """Run the lines of a block; each must succeed."""
        for line in re.sub(r"\\\n\s*", "", code).splitlines():
            words = shlex.split(line, comments=True)
            if not words:
                continue
            if words[-1] == "&":
                self._start(words[:-1])
            elif words[0] == "labgym":
                assert main(words[1:]) == 0, line
            elif words[0] == "export":
                name, _, value = words[1].partition("=")
                self._monkeypatch.setenv(name, value)
            else:
                subprocess.run(words, check=True, timeout=600)

    def _start(self, words: list[str]) -> None:
        log = (self._folder / f"background-{len(self._background)}.log").open("wb")
        self._background.append(subprocess.Popen(words, stdout=log, stderr=log))
        if "--port" in words:
            _wait_for(int(words[words.index("--port") + 1]), self._background[-1])

    def close(self) -> None:
        """End the background processes, the last one first."""
        for process in reversed(self._background):
            process.terminate()
            try:
                process.wait(120)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def free_port() -> int:
    """Return a port of this machine that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _wait_for(port: int, process: subprocess.Popen[bytes], seconds: float = 600.0) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        assert process.poll() is None, f"{process.args} ended with {process.returncode}"
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise TimeoutError(f"nobody listens on port {port} after {seconds:g} s")
