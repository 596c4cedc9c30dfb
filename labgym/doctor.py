"""What this machine has for labgym, what is missing, and how to get it."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from typing import Literal

from packaging.requirements import Requirement

from labgym import __version__
from labgym.artefacts import FOLDERS, artefacts
from labgym.errors import LabgymError

DISTRIBUTION = "labgym-nav"
PROBE_SECONDS = 120.0

_RENDER = """
import mujoco
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><light pos="0 0 3"/><geom size=".1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 32, 32)
renderer.update_scene(data)
assert renderer.render().shape == (32, 32, 3)
from OpenGL import GL
print(GL.glGetString(GL.GL_RENDERER).decode())
"""
_EPISODE = """
import gymnasium, labgym
env = gymnasium.make("LabPointNav-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
print("LabPointNav-v0 resets and steps")
"""
_TORCH = "import torch; print(torch.cuda.get_device_name(0) if torch.cuda.is_available() else '')"
_BACKENDS = (
    ("egl", "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri"),
    ("osmesa", "apt-get install libosmesa6"),
    ("glfw", "needs a display, or: apt-get install xvfb, then run under xvfb-run"),
)


@dataclass(frozen=True)
class Finding:
    """One thing looked at.

    Attributes:
        state: ok; missing (core does not work without it); optional (absent, and only an extra needs it).
        remedy: how to get it, empty where nothing is to be done.
    """

    subject: str
    state: Literal["ok", "missing", "optional"]
    detail: str
    remedy: str = ""


def examine() -> tuple[Finding, ...]:
    """Look at interpreter, hardware, packages, artefacts, renderers and display.

    Whatever may crash or hang, such as an OpenGL driver, is tried in a process of its own with a time limit.
    """
    return (*_machine(), *_packages(), *_artefacts(), _episode(), *_renderers(), _display(), _language_model())


def healthy(findings: Sequence[Finding]) -> bool:
    """Tell whether the core works."""
    return all(finding.state != "missing" for finding in findings)


def report(findings: Sequence[Finding]) -> str:
    """Return the findings as a plain text table, remedies under it, and a verdict."""
    subject = max(len(finding.subject) for finding in findings)
    lines = [f"{f.subject:<{subject}}  {f.state:<8}  {f.detail}".rstrip() for f in findings]
    remedies = [f"  {f.subject}: {f.remedy}" for f in findings if f.remedy]
    verdict = "the core works" if healthy(findings) else "the core does not work: mend what is marked missing"
    return "\n".join([*lines, *(["", "How to get what is not there:", *remedies] if remedies else []), "", verdict])


def _machine() -> Iterator[Finding]:
    yield Finding(
        "labgym", "ok", f"{__version__}, {'checkout' if artefacts('eval').parent.name != '_artefacts' else 'wheel'}"
    )
    yield Finding("python", "ok", f"{platform.python_version()} at {sys.executable}")
    yield Finding(
        "system", "ok", f"{platform.system()} {platform.machine()}, {platform.libc_ver()[0]} {platform.libc_ver()[1]}"
    )
    yield Finding(
        "cores", "ok", f"{len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()}"
    )
    total, free = (
        os.sysconf(name) * os.sysconf("SC_PAGE_SIZE") / 2**30 for name in ("SC_PHYS_PAGES", "SC_AVPHYS_PAGES")
    )
    yield Finding("memory", "ok", f"{total:.1f} GiB, {free:.1f} GiB unused")


def _packages() -> Iterator[Finding]:
    try:
        requirements = [Requirement(text) for text in metadata.requires(DISTRIBUTION) or ()]
    except metadata.PackageNotFoundError:
        yield Finding(DISTRIBUTION, "missing", "not installed", "pip install . in a checkout")
        return
    for requirement in requirements:
        if requirement.marker is None:
            yield _package(requirement, extra=None)
    offered = metadata.metadata(DISTRIBUTION).get_all("Provides-Extra") or []
    for extra in sorted(set(offered) - {"all", "dev"}):
        for requirement in requirements:
            if requirement.marker is not None and requirement.marker.evaluate({"extra": extra}):
                yield _package(requirement, extra)
    gpu = _probe(_TORCH) if shutil.which("nvidia-smi") else (False, "")
    yield Finding("gpu", "ok", gpu[1] or "none that torch can use; none is needed")


def _package(requirement: Requirement, extra: str | None) -> Finding:
    state: Literal["missing", "optional"] = "optional" if extra else "missing"
    remedy = (
        f"pip install '{DISTRIBUTION}[{extra}]'"
        if extra
        else f"pip install '{requirement.name}{requirement.specifier}'"
    )
    purpose = f", extra {extra}" if extra else ""
    try:
        version = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return Finding(requirement.name, state, f"not installed{purpose}", remedy)
    if not requirement.specifier.contains(version, prereleases=True):
        return Finding(requirement.name, state, f"{version}, wants {requirement.specifier}{purpose}", remedy)
    return Finding(requirement.name, "ok", version + purpose)


def _artefacts() -> Iterator[Finding]:
    again = f"install {DISTRIBUTION} again"
    for folder in FOLDERS:
        try:
            files = sum(1 for path in artefacts(folder).rglob("*") if path.is_file())
            yield Finding(f"artefacts {folder}", "ok" if files else "missing", f"{files} files", "" if files else again)
        except LabgymError as error:
            yield Finding(f"artefacts {folder}", "missing", str(error), again)


def _episode() -> Finding:
    works, said = _probe(_EPISODE)
    remedy = "" if works else "mend the packages above, then ask again"
    return Finding("environment", "ok" if works else "missing", said, remedy)


def _renderers() -> Iterator[Finding]:
    probes = [(name, remedy, *_probe(_RENDER, MUJOCO_GL=name)) for name, remedy in _BACKENDS]
    enough = any(works for _, _, works, _ in probes)
    for name, remedy, works, said in probes:
        fallback = "one renderer is enough" if enough else "rendered views are ray-traced and need none"
        detail = said if works else f"not here; {fallback}"
        yield Finding(f"renderer {name}", "ok" if works else "optional", detail, "" if enough else remedy)


def _display() -> Finding:
    name = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    return Finding("display", "ok" if name else "optional", name or "none; only an interactive viewer needs one")


def _language_model() -> Finding:
    subject = "language model"
    try:
        from labgym.llm.config import LanguageModelConfig
    except ImportError as error:
        return Finding(subject, "optional", str(error), "mend the packages above")
    if not LanguageModelConfig.configured():
        return Finding(subject, "optional", "none configured; rules describe assets and write protocols")
    try:
        config = LanguageModelConfig.from_environment()
    except LabgymError as error:
        return Finding(subject, "optional", "configured wrongly", str(error))
    return Finding(subject, "ok", f"{config.model} at {config.base_url}{', replayed' if config.replay else ''}")


def _probe(code: str, **environment: str) -> tuple[bool, str]:
    """Run code in a process of its own; return whether it ended well and the last line that it said."""
    variables = {**os.environ, **environment}
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=variables,
            capture_output=True,
            text=True,
            timeout=PROBE_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {PROBE_SECONDS:.0f} s"
    lines = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    return done.returncode == 0, (lines[-1] if lines else "").strip()[:160]
