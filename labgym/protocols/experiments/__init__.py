"""Experiments: reactions with their equation and atomic actions, and the library of them."""

from labgym.protocols.experiments.library import experiments, get, read_experiments
from labgym.protocols.experiments.model import Action, Experiment, ExperimentFile, Material, Portion, Rejection

__all__ = [
    "Action",
    "Experiment",
    "ExperimentFile",
    "Material",
    "Portion",
    "Rejection",
    "experiments",
    "get",
    "read_experiments",
]
