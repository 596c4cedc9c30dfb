"""The help of `labgym`: all commands by what their user does, a line each."""

from __future__ import annotations

from collections.abc import Mapping

SECTIONS: Mapping[str, Mapping[str, str]] = {
    "Start": {
        "run": "run the whole pipeline: layouts, episodes, tables, report",
        "doctor": "check this machine; list what is missing",
    },
    "Evaluate a policy": {
        "eval": "drive the episodes of LabNav, another suite or your layouts",
        "report": "write tables and pages of results",
        "compare": "compare two policies over the same episodes",
        "leaderboard": "show the published results",
        "submit": "write the folder and text of a submission; check one",
        "policies": "list the policies",
        "serve": "serve a policy over HTTP",
    },
    "Watch": {
        "view": "draw a layout or an episode, or watch a policy (--web)",
        "play": "drive by keyboard in the browser",
        "record": "film a policy, or record it for ROS 2",
    },
    "Train agents": {
        "train": "train a policy",
        "data": "make training data",
        "ablate": "run an ablation study of a policy",
        "card": "publish a trained policy with its model card",
    },
    "Design a laboratory": {
        "protocols": "list, write, check, search, import and export protocols",
        "generate": "generate a laboratory for protocols",
        "score": "list metrics, violations and fixes of a layout",
        "repair": "repair a layout",
        "move": "move an object of a layout",
        "trace": "draw how a layout was repaired",
        "compile": "write MuJoCo, USD, glTF, DXF, PDF or ROS files",
        "outline": "read a floor from a DXF drawing or a ROS map",
        "assets": "list, find, check and add assets and reagents",
        "import": "read laboratories of other programs",
    },
    "Study the benchmark": {
        "reproduce": "reproduce published layouts and tables",
        "floors": "write the floors of a split",
        "labnav": "draw the suites of LabNav",
        "describe": "describe splits of floors",
        "coverage": "simulate the 95% intervals",
        "bench": "measure speed",
    },
}
"""Commands with a line each, by section."""

HEAD = """usage: labgym COMMAND [OPTIONS]

Generate chemistry laboratories from protocols and benchmark robot navigation in
them. `labgym COMMAND --help` describes a command, `labgym --version` prints the
version.
"""
FOOT = """
Exit codes: 0 done, 1 a check or a policy failed, 2 bad input, 130 Ctrl-C,
143 SIGTERM.
"""


def overview() -> str:
    """Return the help text, at most 60 lines of 80 characters."""
    width = max(len(name) for commands in SECTIONS.values() for name in commands)
    lines = [HEAD]
    for title, commands in SECTIONS.items():
        lines.append(f"{title}:")
        lines += [f"  {name:{width}}  {line}" for name, line in commands.items()]
    return "\n".join([*lines, FOOT])
