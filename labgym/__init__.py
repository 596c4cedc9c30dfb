"""labgym: from a chemistry protocol to a laboratory that a robot can work in, and a benchmark to trust."""

__version__ = "0.1.0"
