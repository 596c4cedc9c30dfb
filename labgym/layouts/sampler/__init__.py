"""The proposer `sampler`: a model of how language models lay out laboratories, errors included."""

from labgym.layouts.sampler.proposer import SamplerProposer
from labgym.layouts.sampler.rates import Rates, SamplerFile

__all__ = ["Rates", "SamplerFile", "SamplerProposer"]
