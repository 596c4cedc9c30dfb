"""Classification of reagents that the catalog lacks, from their structure by substructure rules (extra `chem`)."""

from labgym.assets.inference.agreement import LabelAgreement, compare, listed
from labgym.assets.inference.bottle import infer
from labgym.assets.inference.classify import Inference, classify
from labgym.assets.inference.prohibited import ProhibitedSubstanceError
from labgym.assets.inference.substructures import Substructures, substructures

__all__ = [
    "Inference",
    "LabelAgreement",
    "ProhibitedSubstanceError",
    "Substructures",
    "classify",
    "compare",
    "infer",
    "listed",
    "substructures",
]
