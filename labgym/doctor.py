"""Diagnoses of this machine: installed and missing parts, and how to install the missing ones."""

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
env = gymnasium.make("LabPointNav-v0", split="test")
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
class Diagnosis:
    """The state of one package, folder or device.

    Attributes:
        subject: name of the package, folder or device.
        state: "ok"; "missing" if labgym does not work without it; "optional" if only an extra needs it.
        detail: version or description.
        remedy: how to install it; empty if nothing needs to be done.
    """

    subject: str
    state: Literal["ok", "missing", "optional"]
    detail: str
    remedy: str = ""


def examine() -> tuple[Diagnosis, ...]:
    """Return the diagnoses of interpreter, hardware, packages, artefacts, renderers, display and language model.

    Parts that may crash or hang, such as an OpenGL driver, are tried in a separate process with a time limit.
    """
    return (*_machine(), *_packages(), *_artefacts(), _episode(), *_renderers(), _display(), _language_model())


def healthy(diagnoses: Sequence[Diagnosis]) -> bool:
    """Return whether everything that labgym requires is installed."""
    return all(diagnosis.state != "missing" for diagnosis in diagnoses)


def report(diagnoses: Sequence[Diagnosis]) -> str:
    """Return the diagnoses as a text table, followed by remedies and a verdict."""
    subject = max(len(diagnosis.subject) for diagnosis in diagnoses)
    lines = [f"{f.subject:<{subject}}  {f.state:<8}  {f.detail}".rstrip() for f in diagnoses]
    remedies = [f"  {f.subject}: {f.remedy}" for f in diagnoses if f.remedy]
    verdict = "labgym works" if healthy(diagnoses) else "labgym does not work: install the parts marked missing"
    return "\n".join([*lines, *(["", "Install the missing packages:", *remedies] if remedies else []), "", verdict])


def _machine() -> Iterator[Diagnosis]:
    yield Diagnosis(
        "labgym", "ok", f"{__version__}, {'checkout' if artefacts('eval').parent.name != '_artefacts' else 'wheel'}"
    )
    yield Diagnosis("python", "ok", f"{platform.python_version()} at {sys.executable}")
    yield Diagnosis(
        "system", "ok", f"{platform.system()} {platform.machine()}, {platform.libc_ver()[0]} {platform.libc_ver()[1]}"
    )
    yield Diagnosis(
        "cores", "ok", f"{len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()}"
    )
    total, free = (
        os.sysconf(name) * os.sysconf("SC_PAGE_SIZE") / 2**30 for name in ("SC_PHYS_PAGES", "SC_AVPHYS_PAGES")
    )
    yield Diagnosis("memory", "ok", f"{total:.1f} GiB, {free:.1f} GiB unused")


def _packages() -> Iterator[Diagnosis]:
    try:
        requirements = [Requirement(text) for text in metadata.requires(DISTRIBUTION) or ()]
    except metadata.PackageNotFoundError:
        yield Diagnosis(DISTRIBUTION, "missing", "not installed", "pip install . in a checkout")
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
    yield Diagnosis("gpu", "ok", gpu[1] or "none usable by torch; labgym does not need one")


def _package(requirement: Requirement, extra: str | None) -> Diagnosis:
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
        return Diagnosis(requirement.name, state, f"not installed{purpose}", remedy)
    if not requirement.specifier.contains(version, prereleases=True):
        return Diagnosis(requirement.name, state, f"{version}, required {requirement.specifier}{purpose}", remedy)
    return Diagnosis(requirement.name, "ok", version + purpose)


def _artefacts() -> Iterator[Diagnosis]:
    reinstall = f"reinstall {DISTRIBUTION}"
    for folder in FOLDERS:
        try:
            files = sum(1 for path in artefacts(folder).rglob("*") if path.is_file())
            yield Diagnosis(
                f"artefacts {folder}", "ok" if files else "missing", f"{files} files", "" if files else reinstall
            )
        except LabgymError as error:
            yield Diagnosis(f"artefacts {folder}", "missing", str(error), reinstall)


def _episode() -> Diagnosis:
    works, line = _probe(_EPISODE)
    remedy = "" if works else "install the missing packages above, then run labgym doctor again"
    return Diagnosis("environment", "ok" if works else "missing", line, remedy)


def _renderers() -> Iterator[Diagnosis]:
    probes = [(name, remedy, *_probe(_RENDER, MUJOCO_GL=name)) for name, remedy in _BACKENDS]
    enough = any(works for _, _, works, _ in probes)
    for name, remedy, works, line in probes:
        fallback = "one renderer is enough" if enough else "without one, views are ray-traced"
        detail = line if works else f"not available; {fallback}"
        yield Diagnosis(f"renderer {name}", "ok" if works else "optional", detail, "" if enough else remedy)


def _display() -> Diagnosis:
    name = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    return Diagnosis("display", "ok" if name else "optional", name or "none; labgym does not need one")


def _language_model() -> Diagnosis:
    subject = "language model"
    try:
        from labgym.llm.config import LanguageModelConfig
    except ImportError as error:
        return Diagnosis(subject, "optional", str(error), "install the missing packages above")
    if not LanguageModelConfig.configured():
        return Diagnosis(subject, "optional", "not configured; rules are used instead")
    try:
        config = LanguageModelConfig.from_environment()
    except LabgymError as error:
        return Diagnosis(subject, "optional", "invalid configuration", str(error))
    return Diagnosis(subject, "ok", f"{config.model} at {config.base_url}{', replayed' if config.replay else ''}")


def _probe(code: str, **environment: str) -> tuple[bool, str]:
    """Run code in a separate process; return whether it succeeded and the last line of its output."""
    variables = {**os.environ, **environment}
    try:
        process = subprocess.run(
            [sys.executable, "-c", code],
            env=variables,
            capture_output=True,
            text=True,
            timeout=PROBE_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {PROBE_SECONDS:.0f} s"
    lines = (process.stdout if process.returncode == 0 else process.stderr).strip().splitlines()
    return process.returncode == 0, (lines[-1] if lines else "").strip()[:160]
