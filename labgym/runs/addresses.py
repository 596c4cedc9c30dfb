"""Addresses of Dask schedulers: which of them may go without TLS."""

from __future__ import annotations

import ipaddress
from urllib.parse import urlsplit

from labgym.errors import OptionError


def check_address(address: str) -> str:
    """Return the scheme of a scheduler's address: "tcp" or "tls".

    Anybody who reaches a scheduler can run any code on its workers, so that plain TCP is limited to loopback.

    Raises:
        OptionError: the address is not like tcp://127.0.0.1:8786, or is beyond loopback without TLS.
    """
    try:
        parts = urlsplit(address)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme not in ("tcp", "tls") or not parts.hostname or not port:
        raise OptionError(f"scheduler is {address[:80]!r}, expected an address such as tcp://127.0.0.1:8786")
    if parts.scheme == "tcp" and not _is_loopback(parts.hostname):
        raise OptionError(
            f"scheduler {address} is not on this machine and has no TLS: anybody who reaches it can run code on its "
            "workers; use tls:// with certificates (docs/scale.md), or an SSH tunnel to 127.0.0.1"
        )
    return parts.scheme


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
