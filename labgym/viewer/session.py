"""A viewer from its start to Ctrl-C."""

from __future__ import annotations

import threading
from collections.abc import Callable

from labgym.viewer.server import ViewerServer
from labgym.viewer.show import Stage


def run_viewer(show: Stage, port: int, first: int = 0, opened: Callable[[str], None] = lambda _: None) -> None:
    """Serve a show on loopback and drive it in this thread until an exception such as KeyboardInterrupt ends it.

    Args:
        port: port to listen on; 0 takes a free one.
        first: number of the first episode.
        opened: receives the URL of the page.

    Raises:
        OptionError: the port is not available.
    """
    with ViewerServer(show, port) as server:
        thread = threading.Thread(target=server.serve_forever, name="viewer", daemon=True)
        thread.start()
        try:
            opened(server.url)
            show.run(first)
        finally:
            server.shutdown()
            thread.join()
