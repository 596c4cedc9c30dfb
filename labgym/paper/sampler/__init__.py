"""The proposer `sampler`: a model of how language models lay out laboratories, errors included."""

from labgym.paper.sampler.proposer import SamplerProposer
from labgym.paper.sampler.rates import Rates, SamplerFile

__all__ = ["Rates", "SamplerFile", "SamplerProposer"]
