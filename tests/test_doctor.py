from __future__ import annotations

from importlib import metadata

import pytest

from labgym import doctor
from labgym.cli import main
from labgym.doctor import Diagnosis, examine, healthy, report


@pytest.fixture(scope="module")
def diagnoses() -> tuple[Diagnosis, ...]:
    return examine()


def test_labgym_works_here(diagnoses):
    assert healthy(diagnoses), report(diagnoses)
    assert report(diagnoses).endswith("labgym works")


def test_every_core_dependency_is_named_with_its_version(diagnoses):
    details = {diagnosis.subject: diagnosis.detail for diagnosis in diagnoses}
    for text in metadata.requires("labgym-nav") or ():
        if "extra ==" not in text:
            name = doctor.Requirement(text).name
            assert details[name] == metadata.version(name)


def test_a_missing_or_old_core_package_is_bad_and_says_how_to_get_it():
    for requirement in ("no-such-package>=1", "numpy>=999"):
        diagnosis = doctor._package(doctor.Requirement(requirement), extra=None)
        assert diagnosis.state == "missing"
        assert f"pip install '{requirement}'" in diagnosis.remedy
        assert not healthy([diagnosis])
        assert "Install the missing packages:" in report([diagnosis])


def test_a_missing_extra_is_no_failure():
    diagnosis = doctor._package(doctor.Requirement("no-such-package>=1"), extra="usd")
    assert diagnosis.state == "optional"
    assert healthy([diagnosis])
    assert "labgym-nav[usd]" in diagnosis.remedy


def test_a_probe_that_crashes_or_hangs_is_a_finding_not_a_failure(monkeypatch):
    works, line = doctor._probe("import os, sys; sys.stderr.write('GL is gone'); os._exit(3)")
    assert (works, line) == (False, "GL is gone")
    assert doctor._probe("import ctypes; ctypes.string_at(0)")[0] is False
    monkeypatch.setattr(doctor, "PROBE_SECONDS", 0.5)
    works, line = doctor._probe("import time; time.sleep(60)")
    assert not works
    assert "no answer" in line


def test_the_command_exits_with_the_verdict(diagnoses, monkeypatch, capsys):
    missing = Diagnosis("numpy", "missing", "not installed", "pip install numpy")
    for found, code in ((diagnoses, 0), ((*diagnoses, missing), 1)):
        monkeypatch.setattr(doctor, "examine", lambda found=found: found)
        assert main(["doctor"]) == code
        printed = capsys.readouterr()
        assert printed.err == ""
        assert "renderer egl" in printed.out


def test_the_language_model_is_named_without_its_key(monkeypatch):
    for name in ("BASE_URL", "MODEL", "API_KEY", "TIMEOUT"):
        monkeypatch.delenv(f"LABGYM_LLM_{name}", raising=False)
    assert doctor._language_model().state == "optional"
    monkeypatch.setenv("LABGYM_LLM_BASE_URL", "http://127.0.0.1:1/v1")
    monkeypatch.setenv("LABGYM_LLM_MODEL", "local")
    monkeypatch.setenv("LABGYM_LLM_API_KEY", "sk-secret")
    assert doctor._language_model() == Diagnosis("language model", "ok", "local at http://127.0.0.1:1/v1")
    monkeypatch.setenv("LABGYM_LLM_TIMEOUT", "soon")
    wrong = doctor._language_model()
    assert "LABGYM_LLM_TIMEOUT" in wrong.remedy
    assert healthy([wrong])
