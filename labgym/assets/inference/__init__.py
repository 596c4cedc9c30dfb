"""Classification of reagents that the catalog lacks, from their structure by substructure rules (extra `chem`)."""

from labgym.assets.inference.agreement import Disagreement, LabelAgreement, LabelScore, compare, listed
from labgym.assets.inference.bottle import infer
from labgym.assets.inference.classify import Inference, classify
from labgym.assets.inference.prohibited import ProhibitedSubstanceError
from labgym.assets.inference.substructures import Reason, Substructure, Substructures, substructures

__all__ = [
    "Disagreement",
    "Inference",
    "LabelAgreement",
    "LabelScore",
    "ProhibitedSubstanceError",
    "Reason",
    "Substructure",
    "Substructures",
    "classify",
    "compare",
    "infer",
    "listed",
    "substructures",
]
