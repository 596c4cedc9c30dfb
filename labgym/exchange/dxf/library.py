"""The library ezdxf, imported when a drawing is written or read."""

from __future__ import annotations

import logging
from types import ModuleType

from labgym.errors import MissingDependencyError


def load_ezdxf() -> ModuleType:
    """Return the module ezdxf, whose log messages are silenced.

    Raises:
        MissingDependencyError: ezdxf is not installed.
    """
    try:
        import ezdxf
    except ImportError:
        raise MissingDependencyError("ezdxf", "a DXF drawing", "cad") from None
    logging.getLogger("ezdxf").setLevel(logging.CRITICAL)
    return ezdxf
