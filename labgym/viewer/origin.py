"""Which requests a viewer answers: those that its page sends to a loopback name."""

from __future__ import annotations

from email.message import Message
from urllib.parse import urlsplit

LOOPBACK = ("127.0.0.1", "localhost", "::1")


def foreign_problem(headers: Message, changes: bool) -> str | None:
    """Return why a request may come from another site's page, or None.

    A page whose name has been made to resolve to 127.0.0.1 (DNS rebinding) still shows that name in `Host`. Browsers
    name the page of a request in `Origin`, and its relation to the server in `Sec-Fetch-Site`.

    Args:
        headers: headers of the request.
        changes: whether the request changes something; it then must name its origin.
    """
    host = headers.get("Host", "").strip().lower()
    try:
        name = urlsplit(f"//{host}").hostname
    except ValueError:
        name = None
    if name not in LOOPBACK:
        return f"Host is {host[:80]!r}, expected 127.0.0.1 or localhost"
    origin = headers.get("Origin")
    if origin is None and changes:
        return "a command needs the header Origin"
    if origin is not None and origin.lower() != f"http://{host}":
        return f"Origin is {origin[:80]!r}, expected http://{host[:80]}"
    if headers.get("Sec-Fetch-Site", "same-origin") not in ("same-origin", "none"):
        return "requests of other sites are refused (header Sec-Fetch-Site)"
    return None
