"""An optional client of language models: structured questions to any OpenAI-compatible endpoint."""

from labgym.llm.client import LanguageModel, Reply, Usage
from labgym.llm.config import LanguageModelConfig
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.prompting import load_prompt

__all__ = [
    "LanguageModel",
    "LanguageModelConfig",
    "LanguageModelError",
    "Message",
    "Reply",
    "Usage",
    "load_prompt",
]
