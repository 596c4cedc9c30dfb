"""Serve a policy with the NavDP benchmark's protocol, to its clients and to other labgyms."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from http import HTTPStatus
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym import __version__
from labgym.documents import parse_json
from labgym.errors import DocumentError, LabgymError
from labgym.policies.http.bounded import BoundedHandler, BoundedServer
from labgym.policies.http.forms import decode_form
from labgym.policies.http.origin import browser_problem
from labgym.policies.http.served import Frame, ServedPolicy, blank_frame
from labgym.policies.http.slots import Budget
from labgym.policies.http.wire import WireError, decode_color, decode_depth
from labgym.policies.policy import Policy

MAX_BODY = 64 * 1024 * 1024
"""Largest request, bytes."""
MAX_BODIES = 2 * MAX_BODY
"""Largest sum of the sizes of all requests that are read or answered at one time, bytes."""
MAX_JSON = 1024 * 1024
"""Largest JSON text of a request, bytes."""
MAX_BATCH = 16
"""Largest number of robots of one server."""
ANSWER_TIME = 30.0
"""Seconds within which a client must read an answer."""
LARGEST = 1e5
"""Largest number in a request: goals, positions and focal lengths beyond it are refused."""

Array = NDArray[np.float64]


class NavigationServer(BoundedServer):
    """Answers `/navigator_reset`, `/navigator_reset_env` and `/pointgoal_step`; one request drives at a time.

    Each robot of a batch has its own policy. `stop_threshold` is accepted and ignored: our policies have their own
    thresholds. An answer has one trajectory per robot, with the value 0. Requests of web browsers are refused.

    Args:
        make: returns a new policy.
        host, port: address to listen on; port 0 takes a free one, which `url` contains.
        seed: random seed of the policies.

    Raises:
        LabgymError: the policy needs the map, or fails on an empty frame.
        OptionError: the address is not available.
    """

    def __init__(self, make: Callable[[], Policy], host: str = "127.0.0.1", port: int = 8888, seed: int = 0) -> None:
        self.fleet = _Fleet(make, seed)
        self.budget = Budget(MAX_BODIES)
        super().__init__(host, port, _Handler)

    @property
    def url(self) -> str:
        """URL of the server."""
        host, port = self.server_address[:2]
        return f"http://{host if isinstance(host, str) else host.decode()}:{port}"

    def server_close(self) -> None:
        """Stop listening and close the policies."""
        super().server_close()
        self.fleet.close()


class _Fleet:
    """The policies of one server, one per robot; one request at a time uses them."""

    def __init__(self, make: Callable[[], Policy], seed: int) -> None:
        self._make, self._lock = make, threading.Lock()
        self._seed = np.random.SeedSequence(seed)
        self._intrinsic: Array | None = None
        first = make()
        if first.privileged:
            raise LabgymError(f"policy {first.name!r} cannot be served: it needs the map, which clients do not send")
        self.name = first.name
        served = ServedPolicy(first, self._seed.spawn(1)[0])
        try:
            served.trajectory(blank_frame())
        except Exception as error:
            first.close()
            raise LabgymError(f"policy {first.name!r} cannot be served: {_one_line(error)}") from error
        served.forget()
        self._robots = [served]

    def reset(self, content: dict[str, Any]) -> None:
        """Set the camera and the number of robots, and start new episodes."""
        intrinsic = _numbers(content.get("intrinsic"), "intrinsic")
        if intrinsic.shape not in ((3, 3), (4, 4)) or intrinsic[0, 0] <= 0.0 or intrinsic[1, 1] <= 0.0:
            raise WireError("intrinsic is not a camera matrix of 3 x 3 with focal lengths above 0")
        batch = content.get("batch_size", 1)
        if isinstance(batch, bool) or not isinstance(batch, int) or not 1 <= batch <= MAX_BATCH:
            raise WireError(f"batch_size is {str(batch)[:40]}, expected a whole number from 1 to {MAX_BATCH}")
        with self._lock:
            while len(self._robots) > batch:
                self._robots.pop().close()
            while len(self._robots) < batch:
                self._robots.append(ServedPolicy(self._make(), self._seed.spawn(1)[0]))
            for robot in self._robots:
                robot.forget()
            self._intrinsic = intrinsic[:3, :3]

    def reset_one(self, content: dict[str, Any]) -> None:
        """Start a new episode of one robot."""
        index = content.get("env_id")
        with self._lock:
            if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(self._robots):
                raise WireError(f"env_id is {str(index)[:40]}, expected 0 to {len(self._robots) - 1}")
            self._robots[index].forget()

    def step(self, parts: dict[str, bytes]) -> dict[str, Any]:
        """Return the answer to a form."""
        with self._lock:
            if self._intrinsic is None:
                raise WireError("the camera is unknown; call /navigator_reset first")
            frames = _frames(parts, len(self._robots), self._intrinsic)
            trajectories = [robot.trajectory(frame) for robot, frame in zip(self._robots, frames, strict=True)]
        answer = np.stack(trajectories)
        return {
            "trajectory": answer.tolist(),
            "all_trajectory": answer[:, None].tolist(),
            "all_values": [[0.0]] * len(answer),
        }

    def close(self) -> None:
        with self._lock:
            while self._robots:
                self._robots.pop().close()


class _Handler(BoundedHandler):
    server: NavigationServer

    def do_POST(self) -> None:  # noqa: N802
        """Answer a request of the protocol."""
        size = self._size()
        if size is None:
            return
        budget = self.server.budget
        if not budget.take(size):
            self.close_connection = True
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE, "too many large requests at one time; send it again later")
            return
        try:
            self._post(size)
        finally:
            budget.give_back(size)

    def _post(self, size: int) -> None:
        fleet = self.server.fleet
        try:
            body = self._body(size)
            if self.path == "/navigator_reset":
                fleet.reset(_object(body, self.path))
                self._answer(HTTPStatus.OK, {"algo": fleet.name})
            elif self.path == "/navigator_reset_env":
                fleet.reset_one(_object(body, self.path))
                self._answer(HTTPStatus.OK, {"algo": fleet.name})
            elif self.path == "/pointgoal_step":
                self._answer(HTTPStatus.OK, fleet.step(decode_form(self.headers.get("Content-Type", ""), body)))
            else:
                self._refuse(HTTPStatus.NOT_FOUND, "unknown path; POST /navigator_reset, then /pointgoal_step")
        except (WireError, DocumentError) as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
        except OSError:
            self.close_connection = True
        except Exception as error:  # noqa: BLE001 - a policy may raise anything, and the client must learn of it
            self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, f"policy {fleet.name!r}: {_one_line(error)}")

    def do_GET(self) -> None:  # noqa: N802
        """Return the name of the policy and the version."""
        if not self._is_from_browser():
            self._answer(HTTPStatus.OK, {"algo": self.server.fleet.name, "version": __version__})

    def _size(self) -> int | None:
        """Return the size of the request's body; refuse a request without a valid one, or of a web page."""
        if self._is_from_browser():
            return None
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or len(length) > 12 or "Transfer-Encoding" in self.headers:
            problem = "the request has no valid Content-Length"
        elif int(length) > MAX_BODY:
            problem = f"the request has {length} bytes; at most {MAX_BODY} are read"
        else:
            return int(length)
        self.close_connection = True
        self._refuse(HTTPStatus.BAD_REQUEST, problem)
        return None

    def _is_from_browser(self) -> bool:
        problem = browser_problem(self.headers, str(self.server.host))
        if problem is not None:
            self.close_connection = True
            self._refuse(HTTPStatus.FORBIDDEN, problem)
        return problem is not None

    def _body(self, size: int) -> bytes:
        body = self.rfile.read(size)
        if len(body) < size:
            raise ConnectionAbortedError
        self.server.slots.request_complete(self.connection)
        return body

    def _refuse(self, status: HTTPStatus, problem: str) -> None:
        self._answer(status, {"error": problem[:500]})

    def _answer(self, status: HTTPStatus, content: dict[str, Any]) -> None:
        data = json.dumps(content, allow_nan=False).encode()
        self.connection.settimeout(ANSWER_TIME)
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(data)


def _object(body: bytes, source: str) -> dict[str, Any]:
    if len(body) > MAX_JSON:
        raise WireError(f"{source}: {len(body)} bytes of JSON; at most {MAX_JSON} are read")
    content = parse_json(body, source)
    if not isinstance(content, dict):
        raise WireError(f"{source}: expected a JSON object")
    return content


def _frames(parts: dict[str, bytes], batch: int, intrinsic: Array) -> list[Frame]:
    for name in ("image", "depth", "goal_data"):
        if name not in parts:
            raise WireError(f"the form has no {name}; expected files image and depth and the field goal_data")
    color, depth = decode_color(parts["image"], batch), decode_depth(parts["depth"], batch)
    if color.shape[:3] != depth.shape:
        raise WireError(f"image has shape {color.shape[:3]} and depth {depth.shape}; expected equal shapes")
    data = _object(parts["goal_data"], "goal_data")
    goals = np.column_stack([_column(data.get(key), key, batch) for key in ("goal_x", "goal_y")])
    states = _states(parts.get("state_data"), batch)
    return [
        Frame(color[k], depth[k], (float(goals[k, 0]), float(goals[k, 1])), intrinsic, *states[k]) for k in range(batch)
    ]


def _states(raw: bytes | None, batch: int) -> list[tuple[tuple[float, float, float] | None, tuple[float, float]]]:
    """Return pose and velocity of each robot; without `state_data` the poses are None."""
    data = _object(raw, "state_data") if raw else {}
    if "robot_pos" not in data or "robot_quat" not in data:
        return [(None, (0.0, 0.0))] * batch
    places, turns = _numbers(data["robot_pos"], "robot_pos"), _numbers(data["robot_quat"], "robot_quat")
    speeds = _numbers(data["velocity"], "velocity") if "velocity" in data else np.zeros((batch, 2))
    if places.shape not in ((batch, 2), (batch, 3)) or turns.shape != (batch, 4) or speeds.shape != (batch, 2):
        raise WireError("state_data has wrong shapes; expected robot_pos (B, 3), robot_quat (B, 4) and velocity (B, 2)")
    yaws = np.arctan2(
        2.0 * (turns[:, 3] * turns[:, 2] + turns[:, 0] * turns[:, 1]),
        1.0 - 2.0 * (turns[:, 1] ** 2 + turns[:, 2] ** 2),
    )
    return [
        ((float(places[k, 0]), float(places[k, 1]), float(yaws[k])), (float(speeds[k, 0]), float(speeds[k, 1])))
        for k in range(batch)
    ]


def _column(content: object, name: str, batch: int) -> Array:
    column = _numbers(content, name)
    if column.shape != (batch,):
        raise WireError(f"{name} has shape {column.shape}, expected a list of {batch}")
    return column


def _numbers(content: object, name: str) -> Array:
    try:
        numbers = np.asarray(content, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)
    if not np.isfinite(numbers).all() or np.abs(numbers).max(initial=0.0) > LARGEST:
        raise WireError(f"{name} is not finite numbers of at most {LARGEST:g}")
    return numbers


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:400]
