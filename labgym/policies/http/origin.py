"""Requests of web browsers, which are refused: a web page must not reach a policy server of the visitor's machine."""

from __future__ import annotations

from email.message import Message
from ipaddress import ip_address
from urllib.parse import urlsplit

LOOPBACK_NAME = "localhost"


def browser_problem(headers: Message, host: str) -> str | None:
    """Return why a request may be that of a web page, or None.

    Browsers name the page's site in `Origin`, which no client of the protocol does. A page whose name has been made to
    resolve to 127.0.0.1 (DNS rebinding) still shows that name in `Host`; a server on a loopback address therefore
    accepts loopback names only.

    Args:
        headers: headers of the request; names compare without regard to case.
        host: address that the server listens on.
    """
    if "Origin" in headers or "Sec-Fetch-Site" in headers:
        return "requests of web pages are refused (header Origin or Sec-Fetch-Site)"
    name = _host_name(headers.get("Host", ""))
    if name and _is_loopback(host) and name != host.lower() and not _is_loopback(name):
        return f"Host is {name[:80]!r}, expected localhost or 127.0.0.1; use that name, or serve with --host"
    return None


def _host_name(header: str) -> str:
    try:
        return urlsplit(f"//{header.strip()}").hostname or ""
    except ValueError:
        return header.strip().lower()


def _is_loopback(name: str) -> bool:
    try:
        return name.lower() == LOOPBACK_NAME or ip_address(name).is_loopback
    except ValueError:
        return False
