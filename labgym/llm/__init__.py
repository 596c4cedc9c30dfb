"""A client of language models, optional: questions of a given shape to any OpenAI-compatible endpoint."""

from labgym.llm.client import LanguageModel, Reply, Usage
from labgym.llm.config import LanguageModelConfig
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.prompting import Prompt, load_prompt, prompts
from labgym.llm.writer import LanguageWriter, Material

__all__ = [
    "LanguageModel",
    "LanguageModelConfig",
    "LanguageModelError",
    "LanguageWriter",
    "Material",
    "Message",
    "Prompt",
    "Reply",
    "Usage",
    "load_prompt",
    "prompts",
]
