"""Write generated documentation: JSON Schemas, the environment's page and the tables in the README.

`python docs/generate.py` writes schemas and pages. With `--check` it writes nothing and exits 1 if a file is out of
date. With `--run runs/default` it also writes that run's tables and pictures into the README.
"""

from __future__ import annotations

import argparse
import inspect
import json
import sys
from pathlib import Path

from labgym.assets import AssetFile
from labgym.assets.forge import Annotation
from labgym.assets.inference import Substructures
from labgym.assets.lookalikes import Lookalikes
from labgym.assets.reactivity import Reactivity
from labgym.documents import Document, tagged, write_bytes, write_text
from labgym.envs import LabPointNavEnv
from labgym.errors import LabgymError
from labgym.eval import LayoutReport, LayoutSummary
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.suites import Suite
from labgym.eval.reports.comparison import Comparison
from labgym.layouts import Layout
from labgym.layouts.rooms import RoomFile
from labgym.layouts.splits import Manifest
from labgym.layouts.version1 import Layout1
from labgym.llm.replay import RecordedReply
from labgym.protocols import Protocol
from labgym.protocols.experiments import ExperimentFile
from labgym.protocols.language.vocabulary import Vocabulary
from labgym.protocols.language.words import Words
from labgym.protocols.refusals import Refusals
from labgym.protocols.synthesis.operations import Operations
from labgym.protocols.synthesis.transformations import Transformations

DOCS = Path(__file__).resolve().parent
README = DOCS.parent / "README.md"
SHOWN = "test-alk_01"
"""The published layout shown in the README's pictures."""

BEGIN, END = "<!-- tables: begin -->", "<!-- tables: end -->"
DOCUMENTS: tuple[type[Document], ...] = (
    AssetFile,
    Annotation,
    Lookalikes,
    Reactivity,
    Substructures,
    Protocol,
    ExperimentFile,
    Layout1,
    Layout,
    RoomFile,
    Manifest,
    Suite,
    LayoutReport,
    LayoutSummary,
    NavigationSummary,
    Comparison,
    RecordedReply,
    Words,
    Vocabulary,
    Operations,
    Transformations,
    Refusals,
)


def schema(document: type[Document]) -> str:
    """Return the JSON Schema of a document, including its `schema` field."""
    body = tagged(document.model_json_schema(mode="validation"), document)
    return (
        json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **body}, indent=1, ensure_ascii=False)
        + "\n"
    )


def environment_page(environment: type) -> str:
    """Return the page of an environment: its docstring under a heading."""
    return f"# LabPointNav-v0\n\n{inspect.cleandoc(environment.__doc__ or '')}\n"


def pages() -> dict[Path, str]:
    """Return the contents of all generated files in docs/ by path."""
    schemas = {DOCS / "schemas" / f"{d.SCHEMA.partition('.')[2].replace('/', '-')}.json": schema(d) for d in DOCUMENTS}
    return {**schemas, DOCS / "environment.md": environment_page(LabPointNavEnv)}


def with_tables(readme: str, tables: str) -> str:
    """Return the README with the block between its markers replaced.

    Raises:
        LabgymError: the markers are missing.
    """
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise LabgymError(f"{README.name} has no block between {BEGIN} and {END}")
    return f"{before}{BEGIN}\n\n{tables.strip()}\n\n{END}{after}"


def main() -> int:
    """Write or check the generated files and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--run", type=Path)
    arguments = parser.parse_args()
    files = pages()
    if arguments.run:
        tables = (arguments.run / "tables.md").read_text(encoding="utf-8")
        files[README] = with_tables(README.read_text(encoding="utf-8"), tables)
        for name, folder in (("overview", "views"), ("topdown", "pictures")):
            write_bytes(DOCS / "pictures" / f"{name}.png", (arguments.run / folder / f"{SHOWN}.png").read_bytes())
    stale = [path for path, text in files.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        print(f"{'stale' if arguments.check else 'written'}: {path.relative_to(DOCS.parent)}")
        if not arguments.check:
            write_text(path, files[path])
    return int(arguments.check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
