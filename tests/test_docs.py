from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from labgym.layouts import load_published, published
from labgym.protocols import protocols

ROOT = Path(__file__).resolve().parents[1]


def test_generated_files_are_what_the_command_makes():
    done = subprocess.run(
        [sys.executable, "docs/generate.py", "--check"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("schema", "data"),
    [
        ("layout-2", load_published("test", published("test")[0]).to_json()),
        ("protocol-1", protocols()["sub_01"].to_json()),
    ],
)
def test_schemas_name_every_field_of_a_published_document(schema, data):
    described = json.loads((ROOT / "docs" / "schemas" / f"{schema}.json").read_text())
    assert data.keys() <= described["properties"].keys()
    assert set(described["required"]) <= data.keys()
    assert described["properties"]["schema"]["const"] == data["schema"]


@pytest.mark.parametrize(
    "page", ["README.md", "CHANGELOG.md", *(p.relative_to(ROOT).as_posix() for p in ROOT.glob("docs/**/*.md"))]
)
def test_links_and_pictures_of_a_page_are_there(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert ((ROOT / page).parent / target).exists(), f"{page} links to {target}"


def test_the_environment_page_is_the_class_s_own_text():
    from labgym.envs import LabPointNavEnv

    page = (ROOT / "docs" / "environment.md").read_text(encoding="utf-8")
    for line in (LabPointNavEnv.__doc__ or "").splitlines():
        assert line.strip() in page
