"""What comes through a connection: requests to `serve`, answers of policy servers and of language models."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from pydantic import BaseModel

from fuzz.mutation import HOSTILE, mutated_bytes, mutated_data, mutated_file, mutated_json
from fuzz.target import Case, Target
from labgym.cli.arguments import parse_options
from labgym.documents import parse_json
from labgym.errors import LabgymError
from labgym.llm.client import LanguageModel
from labgym.llm.completion import validated
from labgym.llm.config import LanguageModelConfig
from labgym.llm.messages import Message
from labgym.policies import make_policy
from labgym.policies.http.client import checked_trajectory
from labgym.policies.http.connection import Connection
from labgym.policies.http.forms import encode_form
from labgym.policies.http.server import NavigationServer
from labgym.policies.http.wire import encode_color, encode_depth, intrinsic_matrix

RESET = {"intrinsic": intrinsic_matrix(640, 360, 1.2).tolist(), "stop_threshold": -3.0, "batch_size": 1}
GOAL = {"goal_x": [2.0], "goal_y": [0.5]}
STATE = {"robot_pos": [[0.0, 0.0, 0.0]], "robot_quat": [[0.0, 0.0, 0.0, 1.0]], "velocity": [[0.1, 0.0]]}
COMPLETION = {
    "id": "c",
    "object": "chat.completion",
    "choices": [{"index": 0, "message": {"role": "assistant", "content": '{"answer": "yes", "sure": 0.5}'}}],
    "usage": {"prompt_tokens": 100, "completion_tokens": 20},
}


class Answer(BaseModel):
    """What the language model is asked for."""

    answer: str
    sure: float


def targets() -> Iterator[Target]:
    """Yield a target for each direction."""
    yield Target("serve requests", lambda: partial(_request, False), _serve)
    yield Target("serve forms", lambda: partial(_request, True), _serve)
    yield Target("policy server answers", lambda: _answer, _post)
    yield Target("language model replies", lambda: _completion, _ask)
    yield Target("language model texts", lambda: _text, _validate)
    yield Target("language model configuration", lambda: _environment, _configure)
    yield Target("policy options", lambda: _options, _parse_options)


def _request(forms: bool, rng: Random | None) -> Case:
    """Return a reset and a step; the second is the changed one if `forms`, else both may be damaged as bytes."""
    color, depth = np.zeros((1, 36, 64, 3), np.uint8), np.ones((1, 36, 64), np.float32)
    fields = {"goal_data": json.dumps(GOAL), "state_data": json.dumps(STATE), "depth_time": "0.1", "rgb_time": "0.1"}
    files = {
        "image": ("image.jpg", "image/jpeg", encode_color(color)),
        "depth": ("depth.png", "image/png", encode_depth(depth)),
    }
    reset = json.dumps(RESET).encode()
    if rng is not None and forms:
        match rng.randrange(5):
            case 0:
                reset = mutated_json(rng, RESET)
            case 1:
                fields["goal_data"] = mutated_json(rng, GOAL).decode("latin-1")
            case 2:
                fields["state_data"] = mutated_json(rng, STATE).decode("latin-1")
            case 3:
                name = rng.choice(list(files))
                files[name] = (*files[name][:2], mutated_bytes(rng, files[name][2]))
            case 4:
                holder: dict[str, Any] = rng.choice((fields, files))
                del holder[rng.choice(list(holder))]
    kind, body = encode_form(fields, files)
    step = _http("/pointgoal_step", kind, body)
    first = _http("/navigator_reset", "application/json", reset)
    if rng is not None and not forms:
        first = mutated_bytes(rng, first) if rng.random() < 0.5 else first
        head, gap, rest = step.partition(b"\r\n\r\n")
        if rng.random() < 0.5:
            head = mutated_file(rng, head.decode())
        else:
            rest = mutated_bytes(rng, rest)
        step = head + gap + rest
    return {"reset": first, "step": step}


def _http(path: str, kind: str, body: bytes) -> bytes:
    head = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n\r\n"
    return head.encode() + body


@cache
def _server() -> NavigationServer:
    server = NavigationServer(lambda: make_policy("straight"), port=0)
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    return server


def _serve(folder: Path) -> None:
    """Send the requests; the server answers or closes the connection, never fails, and serves the next client."""
    server = _server()
    statuses = []
    for name in ("reset", "step"):
        answer = _sent(server.server_port, (folder / name).read_bytes())
        statuses.append(int(answer[9:12]) if answer.startswith(b"HTTP/1.") else 0)
    if _sent(server.server_port, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")[9:12] != b"200":
        raise AssertionError("the server does not serve the next client")
    if 500 in statuses:
        raise AssertionError("status 500")
    if statuses != [200, 200]:
        raise LabgymError(f"refused with {statuses}")


def _sent(port: int, request: bytes) -> bytes:
    """Return the answer to bytes, after which the client has nothing more to say."""
    answer = b""
    with socket.create_connection(("127.0.0.1", port), timeout=30) as connection, suppress(ConnectionError):
        connection.sendall(request)
        connection.shutdown(socket.SHUT_WR)
        while chunk := connection.recv(65536):
            answer += chunk
    return answer


def _answer(rng: Random | None) -> Case:
    data = {"trajectory": [[[0.1 * k, 0.0, 0.0] for k in range(24)]], "all_trajectory": [], "all_values": [[0.0]]}
    body = json.dumps(data).encode() if rng is None or rng.random() < 0.3 else mutated_json(rng, data)
    head = f"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    if rng is not None and rng.random() < 0.5:
        head = mutated_file(rng, head.decode()) if rng.random() < 0.7 else mutated_bytes(rng, head)
    return {"answer": head + body}


@cache
def _listener() -> tuple[socket.socket, dict[str, bytes]]:
    listener, script = socket.create_server(("127.0.0.1", 0)), {"answer": b""}

    def serve() -> None:
        while True:
            connection, _ = listener.accept()
            with connection, suppress(OSError):
                connection.settimeout(10)
                connection.recv(65536)
                connection.sendall(script["answer"])

    threading.Thread(target=serve, daemon=True).start()
    return listener, script


def _post(folder: Path) -> None:
    listener, script = _listener()
    script["answer"] = (folder / "answer").read_bytes()
    connection = Connection(f"http://127.0.0.1:{listener.getsockname()[1]}", retries=0)
    checked_trajectory(connection.post("/pointgoal_step", "text/plain", b"x", 5.0), "server")


def _completion(rng: Random | None) -> Case:
    return {"reply": json.dumps(COMPLETION).encode() if rng is None else mutated_json(rng, COMPLETION)}


class _Recorded:
    """An endpoint that answers with the bytes of a case."""

    def __init__(self, reply: bytes) -> None:
        self._reply = reply

    def complete(self, body: dict[str, Any]) -> bytes:
        return self._reply

    def redacted(self, text: str) -> str:
        return text


def _ask(folder: Path) -> None:
    """Ask a question, with the reply of the case in place of the server's."""
    model = LanguageModel(LanguageModelConfig(base_url="http://127.0.0.1:1/v1", model="m"))
    model._endpoint = _Recorded((folder / "reply").read_bytes())  # type: ignore[assignment]
    model.ask("fuzz/1", (Message("user", "Is it?"),), Answer)


def _text(rng: Random | None) -> Case:
    data = {"answer": "yes", "sure": 0.5}
    text = json.dumps(data).encode() if rng is None else mutated_json(rng, data)
    fenced = rng is not None and rng.random() < 0.3
    return {"text": b"```json\n" + text + b"\n```" if fenced else text}


def _validate(folder: Path) -> None:
    validated((folder / "text").read_bytes().decode("utf-8", "replace"), Answer, "")


def _environment(rng: Random | None) -> Case:
    values = {
        "LABGYM_LLM_BASE_URL": "http://127.0.0.1:8000/v1",
        "LABGYM_LLM_MODEL": "m",
        "LABGYM_LLM_TIMEOUT": "5",
        "LABGYM_LLM_RETRIES": "1",
        "LABGYM_LLM_PRICE_IN": "0.5",
        "LABGYM_LLM_CACHE": "replies",
        "LABGYM_LLM_REPLAY": "false",
    }
    if rng is not None:
        for name in rng.sample(list(values), rng.choice((1, 1, 2))):
            changed = mutated_file(rng, values[name]).decode("utf-8", "replace")
            values[name] = str(rng.choice(HOSTILE)) if rng.random() < 0.5 else changed
    return {"environment.json": json.dumps(values).encode()}


def _configure(folder: Path) -> None:
    LanguageModelConfig.from_environment(json.loads((folder / "environment.json").read_bytes()))


def _options(rng: Random | None) -> Case:
    """Return a policy's name and options as on the command line."""
    texts = ["radius=0.28", "max_speed=0.5"]
    if rng is not None:
        texts = [mutated_file(rng, text).decode("utf-8", "replace") for text in texts]
        if rng.random() < 0.5:
            texts = [f"{rng.choice(('radius', 'options', 'x', 'self'))}={json.dumps(mutated_data(rng, [1, {'a': 2}]))}"]
    return {"options.json": json.dumps(texts if rng else ["radius=0.28"]).encode("utf-8", "surrogatepass")}


def _parse_options(folder: Path) -> None:
    make_policy("dwa", **parse_options(parse_json((folder / "options.json").read_bytes(), "options")))
