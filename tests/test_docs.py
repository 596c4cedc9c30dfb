from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from labgym.layouts import load_published, published
from labgym.protocols import protocols

ROOT = Path(__file__).resolve().parents[1]


def test_generated_files_are_what_the_command_makes():
    done = subprocess.run(
        [sys.executable, "docs/generate.py", "--check"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def generate() -> ModuleType:
    """The module docs/generate.py."""
    spec = importlib.util.spec_from_file_location("labgym_docs_generate", ROOT / "docs" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")
        spec.loader.exec_module(generate)
    return generate


def test_the_film_shows_published_episodes_of_all_tasks(generate):
    assert set(generate.FILM) == set(generate.FIGURE_TASKS)
    for task, (suite, key, _) in generate.FILM.items():
        part, episode, _ = generate.published_episode(suite, f"{task}-{generate.HEADLINE}/{key}")
        assert (part.task, episode.key) == (task, key)


@pytest.fixture(scope="module")
def schemas(generate) -> dict[str, dict[str, object]]:
    """The JSON Schemas of the site by name."""
    return {document.SCHEMA: generate.tagged(document.model_json_schema(), document) for document in generate.DOCUMENTS}


@pytest.mark.parametrize(
    "data",
    [
        load_published("test", published("test")[0]).to_json(),
        protocols()["sub_01"].to_json(),
    ],
    ids=lambda data: data["schema"],
)
def test_schemas_name_every_field_of_a_published_document(schemas, data):
    described = schemas[data["schema"]]
    assert data.keys() <= described["properties"].keys()
    assert set(described["required"]) <= data.keys()
    assert described["properties"]["schema"]["const"] == data["schema"]


PAGES = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")]


@pytest.mark.parametrize("page", [p.relative_to(ROOT).as_posix() for p in (*PAGES, *ROOT.glob("docs/**/*.md"))])
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


def test_every_id_has_a_page_that_names_its_spaces_and_limit():
    import gymnasium as gym

    import labgym  # noqa: F401

    for name in sorted(one for one in gym.registry if one.startswith("Lab") and one != "LabNavMovedFixed-v0"):
        page = (ROOT / "docs" / "environments" / f"{name}.md").read_text(encoding="utf-8")
        env = gym.make(name)
        assert all(f"| `{entry}` |" in page for entry in env.observation_space.spaces)
        assert f"Truncated after {env.spec.max_episode_steps} actions" in page
