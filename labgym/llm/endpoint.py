"""HTTP exchanges with an OpenAI-compatible server, with limits on their whole time, size and number of attempts."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any, Self

import httpx2
import openai

from labgym.llm.config import NO_KEY, LanguageModelConfig
from labgym.llm.errors import LanguageModelError, Reason

OPENED = (".connect_tcp.complete", ".start_tls.complete")
"""Ends of the names of the client's events that return an open connection."""
MAX_REPLY_BYTES = 8 * 1024 * 1024
FIRST_WAIT = 1.0
MAX_WAIT = 60.0
"""Longest wait between two attempts, seconds; if a server asks for a longer one, the request fails."""
QUOTED = 200
RETRIED = ("unreachable", "timeout", "rate_limited", "server")


class Deadline:
    """Breaks an exchange off when its time is over, also while the server sends headers byte by byte.

    The client's own timeout applies to each read alone. Used as a context manager around each exchange.

    Args:
        seconds: greatest duration of an exchange.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.passed = False
        self._socket: socket.socket | None = None
        self._timer: threading.Timer | None = None

    def __enter__(self) -> Self:
        self.passed = False
        self._timer = threading.Timer(self.seconds, self._break_off)
        self._timer.daemon = True
        self._timer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._timer is not None
        self._timer.cancel()

    def watch(self, request: httpx2.Request) -> None:
        """Observe the connection of a request: a hook of the client."""
        request.extensions = {**request.extensions, "trace": self._trace}

    def _trace(self, event: str, info: dict[str, Any]) -> None:
        if event.endswith(OPENED):
            self._socket = info["return_value"].get_extra_info("socket")

    def _break_off(self) -> None:
        self.passed = True
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)


class Endpoint:
    """The chat endpoint of a configuration.

    Args:
        config: address, key and limits.
        sleep: function that waits a number of seconds between two attempts.
    """

    def __init__(self, config: LanguageModelConfig, sleep: Callable[[float], None] = time.sleep) -> None:
        self.config = config
        self._sleep = sleep
        secret = config.api_key.get_secret_value()
        self._secret = secret if secret != NO_KEY else None
        # Redirects are not followed, so the key is sent only to the configured address. Replies are uncompressed, so
        # the limit on their size also limits memory.
        self._deadline = Deadline(config.timeout)
        self._http = openai.DefaultHttpxClient(
            timeout=config.timeout,
            follow_redirects=False,
            headers={"Accept-Encoding": "identity"},
            event_hooks={"request": [self._deadline.watch], "response": [self._bound]},
        )
        self._client = openai.OpenAI(
            api_key=secret,
            base_url=config.base_url,
            timeout=config.timeout,
            max_retries=0,
            http_client=self._http,
            # Other environment variables name OpenAI accounts, which must not be sent to another server.
            default_headers={"OpenAI-Organization": openai.omit, "OpenAI-Project": openai.omit},  # type: ignore[dict-item]
        )

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def complete(self, body: dict[str, Any]) -> bytes:
        """Send a chat request and return the reply's bytes.

        Raises:
            LanguageModelError: all attempts that the configuration allows have failed.
        """
        attempts = 0
        while True:
            attempts += 1
            outcome = self._attempt(body)
            if isinstance(outcome, bytes):
                return outcome
            wait = min(FIRST_WAIT * 2.0 ** (attempts - 1), MAX_WAIT) if outcome.wait is None else outcome.wait
            if outcome.reason not in RETRIED or attempts > self.config.retries or wait > MAX_WAIT:
                # Outside of an `except` block: the context of the error would be the client's error, which holds the
                # key, and Dask sends an error to other processes with its context.
                raise outcome.error(attempts)
            self._sleep(wait)

    def redacted(self, text: str) -> str:
        """Return a text with the key removed."""
        return text.replace(self._secret, "***") if self._secret else text

    def _attempt(self, body: dict[str, Any]) -> bytes | _FailedTryError:
        """Send a chat request once; return the bytes of the reply, or the failure."""
        with self._deadline:
            outcome = self._exchange(body)
        # A reply without a stated length seems complete when its connection is broken off.
        return _late(self.config) if self._deadline.passed else outcome

    def _exchange(self, body: dict[str, Any]) -> bytes | _FailedTryError:
        try:
            return self._client.chat.completions.with_raw_response.create(**body).content
        except _FailedTryError as failure:
            return failure
        except openai.APIStatusError as error:
            return self._refused(error)
        except openai.APITimeoutError:
            return _late(self.config)
        except openai.APIConnectionError as error:
            cause = error.__cause__
            if isinstance(cause, _FailedTryError):
                return cause
            what = self.redacted(str(cause or error))[:QUOTED]
            remedy = "check LABGYM_LLM_BASE_URL and that the server is running"
            return _FailedTryError("unreachable", f"{self.config.base_url} cannot be reached ({what}); {remedy}")

    def _refused(self, error: openai.APIStatusError) -> _FailedTryError:
        status, detail = error.status_code, f"(status {error.status_code}: {self._quoted(error)})"
        server = self.config.base_url
        if status in (401, 403):
            return _FailedTryError("unauthorized", f"{server} rejects the key {detail}; set LABGYM_LLM_API_KEY")
        if status == 429:
            wait = _retry_after(error.response.headers)
            remedy = "wait, or raise LABGYM_LLM_RETRIES"
            request = f"; it asks to wait {wait:g} s" if wait is not None else ""
            return _FailedTryError(
                "rate_limited", f"{server} limits the rate of requests {detail}{request}; {remedy}", wait
            )
        if status in (408, 409) or status >= 500:
            wait = _retry_after(error.response.headers)
            return _FailedTryError("server", f"{server} failed {detail}; try again later", wait)
        if 300 <= status < 400:
            return _FailedTryError(
                "rejected", f"{server} redirects to another address; set LABGYM_LLM_BASE_URL to that address"
            )
        remedy = "check LABGYM_LLM_MODEL and LABGYM_LLM_BASE_URL"
        return _FailedTryError("rejected", f"{server} rejects the request {detail}; {remedy}")

    def _quoted(self, error: openai.APIStatusError) -> str:
        body = error.body
        message = body.get("message") if isinstance(body, dict) else body
        text = " ".join(str(message if message is not None else error.message).split())
        return self.redacted(text)[:QUOTED]

    def _bound(self, response: httpx2.Response) -> None:
        if response.headers.get("content-encoding", "identity") != "identity":
            raise _FailedTryError(
                "malformed", f"{self.config.base_url} compresses its reply although the request excludes compression"
            )
        assert isinstance(response.stream, httpx2.SyncByteStream)
        response.stream = _Bounded(response.stream, self.config)


class _Bounded(httpx2.SyncByteStream):
    """The bytes of a reply, with limits on time and size."""

    def __init__(self, stream: httpx2.SyncByteStream, config: LanguageModelConfig) -> None:
        self._stream, self._config = stream, config
        self._deadline = time.monotonic() + config.timeout

    def __iter__(self) -> Iterator[bytes]:
        length = 0
        for chunk in self._stream:
            length += len(chunk)
            if length > MAX_REPLY_BYTES:
                problem = f"the reply of {self._config.base_url} is larger than {MAX_REPLY_BYTES} bytes"
                raise _FailedTryError("oversize", f"{problem}; check that LABGYM_LLM_BASE_URL is the API")
            if time.monotonic() > self._deadline:
                raise _late(self._config)
            yield chunk

    def close(self) -> None:
        self._stream.close()


class _FailedTryError(Exception):
    """A failed attempt: the reason, and how long the server asks to wait, seconds."""

    def __init__(self, reason: Reason, message: str, wait: float | None = None) -> None:
        super().__init__(message)
        self.reason: Reason = reason
        self.wait = wait

    def error(self, attempts: int) -> LanguageModelError:
        count = f" (tried {attempts} times)" if attempts > 1 else ""
        return LanguageModelError(self.reason, f"language model: {self}{count}")


def _late(config: LanguageModelConfig) -> _FailedTryError:
    remedy = "raise LABGYM_LLM_TIMEOUT, or choose a faster model"
    return _FailedTryError("timeout", f"{config.base_url} did not reply in {config.timeout:g} s; {remedy}")


def _retry_after(headers: httpx2.Headers) -> float | None:
    """Return the seconds that a server asks to wait, or None if it gives none or a date."""
    try:
        seconds = float(headers.get("retry-after", ""))
    except ValueError:
        return None
    return seconds if 0.0 <= seconds < float("inf") else None
