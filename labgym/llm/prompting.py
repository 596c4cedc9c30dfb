"""Prompts: versioned files, and the insertion of untrusted text into them."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from labgym.errors import DocumentError, OptionError
from labgym.llm.messages import Message

MAX_DATUM = 60_000
SLOT = re.compile(r"\{\{([a-z_]+)\}\}")
_FILE = re.compile(
    r"\A---\nversion: (?P<version>[1-9]\d{0,3})\n---\n+# Role\n++(?P<role>.+?)(?<!\n)\n+"
    r"# Question\n++(?P<question>.*\S)\s*\Z",
    re.S,
)


@dataclass(frozen=True)
class Prompt:
    """A prompt, as read from its file.

    Attributes:
        name, version: identity of the prompt.
        role: the system message; it has no slots, so untrusted text cannot get into it.
        question: the user message with slots such as {{text}}.
    """

    name: str
    version: int
    role: str
    question: str

    @property
    def label(self) -> str:
        """Name and version, such as annotate-asset/1."""
        return f"{self.name}/{self.version}"

    @property
    def slots(self) -> frozenset[str]:
        """Names of the slots."""
        return frozenset(SLOT.findall(self.question))

    def fill(self, images: Sequence[bytes] = (), **data: object) -> tuple[Message, ...]:
        """Return the messages with the data filled in.

        Each value becomes a block of JSON without any `<`, so that it cannot end the block; all slots are filled in one
        pass, so that a value cannot open another slot.

        Args:
            images: PNG pictures for the question.
            data: a JSON value for each slot.

        Raises:
            OptionError: a slot has no value, a value has no slot, or a value is too long.
        """
        if set(data) != self.slots:
            raise OptionError(f"prompt {self.name} takes {sorted(self.slots)}, got {sorted(data)}")
        blocks = {name: data_block(name, value) for name, value in data.items()}
        question = SLOT.sub(lambda slot: blocks[slot.group(1)], self.question)
        return (Message("system", self.role), Message("user", question, tuple(images)))


def data_block(name: str, value: object) -> str:
    """Return a value as a delimited block of JSON; the value cannot end the block.

    Raises:
        OptionError: the value is too long for a prompt.
    """
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, sort_keys=True).replace("<", "\\u003c")
    text = "".join(char if char.isprintable() else json.dumps(char)[1:-1] for char in text)
    if len(text) > MAX_DATUM:
        raise OptionError(f"{name} of {len(text)} characters is too long for a prompt; at most {MAX_DATUM}")
    return f'<data name="{name}">\n{text}\n</data>'


def load_prompt(file: Path) -> Prompt:
    """Read a prompt from its file; the file's stem is the prompt's name.

    Raises:
        DocumentError: the file is missing or is not a prompt.
    """
    if not file.is_file():
        raise DocumentError(file, "", "no such file")
    parts = _FILE.match(file.read_text(encoding="utf-8"))
    if parts is None or SLOT.search(parts["role"]):
        raise DocumentError(file, "", "not a prompt: expected a version, then # Role without slots, then # Question")
    return Prompt(file.stem, int(parts["version"]), parts["role"], parts["question"])
