"""A policy in a separate process: the evaluator never calls a policy, it exchanges messages with one."""

from labgym.policies.process.isolated import IsolatedPolicy
from labgym.policies.process.limits import ProcessLimits
from labgym.policies.process.proxy import PolicyProcess, close_shared_process, shared_process
from labgym.policies.process.source import PolicySource

__all__ = ["IsolatedPolicy", "PolicyProcess", "PolicySource", "ProcessLimits", "close_shared_process", "shared_process"]
