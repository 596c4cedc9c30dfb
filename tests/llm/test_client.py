from __future__ import annotations

import base64
import io
import json
import logging
import pickle
import re
import sys
import traceback
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest
from pydantic import BaseModel, Field
from tblib.pickling_support import pickle_exception, pickle_traceback

from labgym.errors import DocumentError, LabgymError, MissingDependencyError, OptionError
from labgym.llm import LanguageModel, LanguageModelConfig, LanguageModelError, Message, Usage
from labgym.llm.endpoint import MAX_REPLY_BYTES, MAX_WAIT

KEY = "sk-loopback-0123456789"
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d49444154789c6360606060000000050001a5f645400000000049454e44ae426082"
)


class Flask(BaseModel):
    name: str = Field(pattern=r"^[A-Z][A-Za-z]+$")
    volume: float = Field(gt=0.0)
    tags: list[str] = []


GOOD = '{"name": "RoundBottomFlask", "volume": 250, "tags": []}'
QUESTION = (Message("system", "You name flasks."), Message("user", "Which?"))


def ask(model: LanguageModel, question: tuple[Message, ...] = QUESTION, prompt: str = "flask/1") -> Any:
    with model:
        return model.ask(prompt, question, Flask)


def failure(model: LanguageModel) -> LanguageModelError:
    with pytest.raises(LanguageModelError) as caught:
        ask(model)
    assert "\n" not in str(caught.value)
    return caught.value


def test_an_answer_arrives_as_the_model_asked_for(loopback, model_at):
    loopback.says(GOOD)
    reply = ask(model_at())
    assert reply.answer == Flask(name="RoundBottomFlask", volume=250.0)
    assert not reply.replayed
    assert loopback.headers[0]["path"] == "/v1/chat/completions"
    assert loopback.headers[0]["authorization"] == f"Bearer {KEY}"


def test_the_server_is_asked_for_a_closed_schema_and_offered_no_tool(loopback, model_at):
    loopback.says(GOOD)
    ask(model_at(temperature=0.5, seed=7, max_tokens=99))
    sent = loopback.requests[0]
    shape = sent["response_format"]["json_schema"]
    assert shape["strict"] is True
    assert shape["schema"]["required"] == ["name", "volume", "tags"]
    assert shape["schema"]["additionalProperties"] is False
    assert (sent["model"], sent["temperature"], sent["seed"], sent["max_tokens"]) == ("test-model", 0.5, 7, 99)
    assert not {"tools", "functions", "tool_choice"} & set(sent)


def test_pictures_travel_as_data_urls(loopback, model_at):
    loopback.says(GOOD)
    ask(model_at(), (Message("user", "Which?", (PNG,)),))
    text, picture = loopback.requests[0]["messages"][0]["content"]
    assert text == {"type": "text", "text": "Which?"}
    kind, _, data = picture["image_url"]["url"].partition(",")
    assert kind == "data:image/png;base64"
    assert base64.b64decode(data) == PNG


@pytest.mark.parametrize("image", [b"GIF89a", PNG + bytes(4 * 1024 * 1024)])
def test_what_is_no_png_or_too_large_is_not_sent(image):
    with pytest.raises(OptionError, match="PNG"):
        Message("user", "Which?", (image,))


def test_only_the_configured_key_is_sent_whatever_else_the_environment_holds(loopback, model_at, monkeypatch):
    for name in ("OPENAI_API_KEY", "OPENAI_ADMIN_KEY", "OPENAI_ORG_ID", "OPENAI_PROJECT_ID"):
        monkeypatch.setenv(name, f"secret-of-{name}")
    loopback.says(GOOD)
    ask(model_at())
    assert "secret-of" not in json.dumps(loopback.headers)


def test_a_server_without_schemas_is_asked_for_json_with_the_schema_in_the_text(loopback, model_at):
    loopback.sends(400, {"error": {"message": "response_format json_schema is not supported"}})
    loopback.says(GOOD)
    with model_at() as model:
        assert ask(model).answer.volume == 250.0
        assert loopback.requests[1]["response_format"] == {"type": "json_object"}
        assert '"volume"' in loopback.requests[1]["messages"][-1]["content"]
        ask(model)
    assert len(loopback.requests) == 3, "what the server cannot do is remembered"


def test_a_server_without_json_mode_may_answer_in_a_code_block(loopback, model_at):
    for _ in range(2):
        loopback.sends(422, {"error": {"message": "unknown field response_format"}})
    loopback.says(f"```json\n{GOOD}\n```")
    assert ask(model_at()).answer.name == "RoundBottomFlask"
    assert "response_format" not in loopback.requests[2]


@pytest.mark.parametrize(
    ("complaint", "gone", "there"),
    [
        ("'max_tokens' is not supported, use 'max_completion_tokens'", "max_tokens", "max_completion_tokens"),
        ("temperature does not support 0.0", "temperature", "max_tokens"),
        ("seed is not permitted", "seed", "max_tokens"),
    ],
)
def test_arguments_that_a_server_does_not_take_are_left_out(loopback, model_at, complaint, gone, there):
    loopback.sends(400, {"error": {"message": complaint}})
    loopback.says(GOOD)
    ask(model_at())
    assert gone not in loopback.requests[1]
    assert there in loopback.requests[1]
    assert loopback.requests[1]["response_format"]["type"] == "json_schema"


def test_a_request_that_is_rejected_in_every_form_ends_with_the_servers_words(loopback, model_at):
    loopback.sends(400, {"error": {"message": "context too long"}})
    error = failure(model_at())
    assert error.reason == "rejected"
    assert "context too long" in str(error)
    assert len(loopback.requests) == 3


def test_a_wrong_model_name_is_reported(loopback, model_at):
    loopback.sends(404, {"error": {"message": "model 'test-model' does not exist"}})
    error = failure(model_at())
    assert error.reason == "rejected"
    assert "LABGYM_LLM_MODEL" in str(error)
    assert len(loopback.requests) == 1


def test_a_wrong_key_is_reported_without_the_key(loopback, model_at, caplog):
    caplog.set_level(logging.DEBUG)
    loopback.sends(401, {"error": {"message": f"Incorrect API key provided: {KEY}"}})
    error = failure(model_at())
    assert error.reason == "unauthorized"
    assert "LABGYM_LLM_API_KEY" in str(error)
    printed = (
        "".join(traceback.format_exception(error)) + caplog.text + repr(error.__dict__) + repr(pickle.dumps(error))
    )
    assert KEY not in printed
    assert len(loopback.requests) == 1, "a wrong key is not tried again"


class DaskPickler(pickle.Pickler):
    """Pickles an error with its traceback, cause and context, as every process does that has imported `distributed`."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, BaseException):
            return pickle_exception(value)
        return pickle_traceback(value) if isinstance(value, TracebackType) else NotImplemented


@pytest.mark.parametrize(
    ("status", "body"),
    [
        (401, {"error": {"message": f"Incorrect API key provided: {KEY}"}}),
        (403, {"error": {"message": "forbidden"}}),
        (400, {"error": {"message": f"bad request of {KEY}"}}),
        (429, {"error": {"message": f"quota of {KEY}"}}),
        (200, {"choices": KEY}),
        (200, f"{KEY}".encode()),
    ],
)
def test_an_error_that_dask_sends_to_another_process_does_not_contain_the_key(loopback, model_at, status, body):
    loopback.sends(status, body)
    error = failure(model_at(retries=0))
    stream = io.BytesIO()
    DaskPickler(stream).dump(error)
    assert KEY.encode() not in stream.getvalue()
    assert str(pickle.loads(stream.getvalue())) == str(error)


def test_an_invalid_variable_is_reported_without_its_value_in_the_context_of_the_error():
    variables = {"LABGYM_LLM_BASE_URL": KEY, "LABGYM_LLM_MODEL": "m"}
    with pytest.raises(DocumentError) as caught:
        LanguageModelConfig.from_environment(variables)
    stream = io.BytesIO()
    DaskPickler(stream).dump(caught.value)
    assert KEY.encode() not in stream.getvalue()


def test_a_rate_limit_is_waited_for_as_long_as_the_server_asks(loopback, model_at, waits):
    loopback.sends(429, {"error": {"message": "slow down"}}, Retry_After="7")
    loopback.sends(429, {"error": {"message": "slow down"}})
    loopback.says(GOOD)
    assert ask(model_at(retries=2)).answer.volume == 250.0
    assert waits == [7.0, 2.0]


def test_a_rate_limit_that_stays_ends_after_the_tries_allowed(loopback, model_at, waits):
    loopback.sends(429, {"error": {"message": "quota"}}, Retry_After="0")
    error = failure(model_at(retries=3))
    assert error.reason == "rate_limited"
    assert "LABGYM_LLM_RETRIES" in str(error)
    assert len(loopback.requests) == 4
    assert waits == [0.0] * 3


def test_a_server_that_asks_for_an_hour_is_not_waited_for(loopback, model_at, waits):
    loopback.sends(429, {"error": {"message": "quota"}}, Retry_After="3600")
    error = failure(model_at())
    assert "3600 s" in str(error)
    assert waits == []
    assert MAX_WAIT < 3600


@pytest.mark.parametrize("value", ["nan", "inf", "-5", "Wed, 21 Oct 2030 07:28:00 GMT", "soon"])
def test_a_senseless_wait_counts_as_none(loopback, model_at, waits, value):
    loopback.sends(503, {"error": {"message": "busy"}}, Retry_After=value)
    loopback.says(GOOD)
    ask(model_at())
    assert waits == [1.0]


def test_a_slow_server_is_given_up_on(loopback, model_at):
    loopback.does(lambda handler: loopback.released.wait(10.0))
    error = failure(model_at(timeout=0.2, retries=0))
    assert error.reason == "timeout"
    assert "LABGYM_LLM_TIMEOUT" in str(error)


def test_a_reply_that_trickles_is_given_up_on(loopback, model_at):
    def trickle(handler: Any) -> None:
        handler.send_response(200)
        handler.end_headers()
        while not loopback.released.wait(0.05):
            handler.wfile.write(b" ")
            handler.wfile.flush()

    loopback.does(trickle)
    assert failure(model_at(timeout=0.4, retries=0)).reason == "timeout"


def test_headers_that_trickle_are_given_up_on(loopback, model_at):
    def trickle(handler: Any) -> None:
        handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
        while not loopback.released.wait(0.05):
            handler.wfile.write(b"X-Wait: 1\r\n")
            handler.wfile.flush()

    loopback.does(trickle)
    assert failure(model_at(timeout=0.4, retries=0)).reason == "timeout"


@pytest.mark.parametrize("status", [200, 500])
def test_a_reply_without_end_is_cut_off(loopback, model_at, status):
    def flood(handler: Any) -> None:
        handler.send_response(status)
        handler.end_headers()
        for _ in range(2 * MAX_REPLY_BYTES // 65536):
            handler.wfile.write(b" " * 65536)

    loopback.does(flood)
    assert failure(model_at(retries=0)).reason == "oversize"


def test_a_reply_that_unpacks_to_more_than_it_looks_is_not_unpacked(loopback, model_at):
    loopback.sends(200, b"\x1f\x8b" + bytes(100), Content_Encoding="gzip")
    assert failure(model_at()).reason == "malformed"
    assert loopback.headers[0]["accept-encoding"] == "identity"


def test_a_connection_lost_in_the_middle_is_tried_again(loopback, model_at, waits):
    def hang_up(handler: Any) -> None:
        handler.send_response(200)
        handler.send_header("Content-Length", "1000")
        handler.end_headers()
        handler.wfile.write(b'{"choices"')
        handler.wfile.flush()
        handler.connection.close()

    loopback.does(hang_up)
    loopback.says(GOOD)
    assert ask(model_at()).answer.volume == 250.0
    assert waits == [1.0]


def test_no_server_at_the_address_is_reported(model_at):
    error = failure(model_at(base_url="http://127.0.0.1:9/v1", retries=1))
    assert error.reason == "unreachable"
    assert "LABGYM_LLM_BASE_URL" in str(error)
    assert "tried 2 times" in str(error)


def test_the_key_follows_no_redirect(loopback, model_at):
    loopback.sends(307, {}, Location="http://127.0.0.1:9/elsewhere")
    error = failure(model_at())
    assert error.reason == "rejected"
    assert "redirects" in str(error)


@pytest.mark.parametrize(
    "body",
    [b"<html>hello</html>", b'{"choices": ', b"[]", b"\xff\xfe", b"[" * 100_000, b'{"choices": [{"message": 1}]}'],
)
def test_what_is_no_completion_is_reported(loopback, model_at, body):
    loopback.sends(200, body)
    error = failure(model_at())
    assert error.reason == "malformed"
    assert "OpenAI-compatible" in str(error)


@pytest.mark.parametrize(
    "text",
    [
        "I think it is a flask.",
        '{"name": "RoundBottomFlask"',
        '{"name": "RoundBottomFlask"}',
        '{"name": "../../etc/passwd", "volume": 1}',
        '{"name": "Flask", "volume": NaN}',
        '{"name": "Flask", "volume": 1e300}',
        "[" * 5000,
    ],
)
def test_an_answer_of_another_shape_is_no_answer(loopback, model_at, text):
    loopback.says(text)
    error = failure(model_at())
    assert error.reason == "malformed"
    assert error.reply == text


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"message": {"content": None, "refusal": "I cannot help with that."}}, "refused"),
        ({"finish_reason": "content_filter"}, "refused"),
        ({"finish_reason": "length"}, "truncated"),
        ({"message": {"content": "  "}}, "empty"),
        ({"message": {"content": None, "tool_calls": [{"id": "1", "function": {"name": "rm"}}]}}, "empty"),
        ({"choices": []}, "empty"),
    ],
)
def test_refusals_and_half_replies_are_told_apart(loopback, model_at, fields, reason, tmp_path):
    loopback.says(GOOD, **fields)
    error = failure(model_at(cache=tmp_path))
    assert error.reason == reason
    assert not list(tmp_path.rglob("*.json")), "what is no answer is not recorded"


def test_tokens_and_cost_add_up(loopback, model_at):
    loopback.says(GOOD)
    loopback.says(GOOD, usage={"prompt_tokens": 1000, "completion_tokens": 500})
    with model_at(price_in=2.0, price_out=10.0) as model:
        ask(model)
        ask(model)
        assert model.usage == Usage(2, 0, 1100, 520, pytest.approx((1100 * 2.0 + 520 * 10.0) / 1e6))
        assert "0.0074 USD" in str(model.usage)


def test_without_prices_there_is_no_cost_and_without_counts_no_tokens(loopback, model_at):
    loopback.says(GOOD, usage=None)
    with model_at() as model:
        ask(model)
        assert model.usage == Usage(1, 0, 0, 0, None)


def test_a_run_is_repeated_without_the_server(loopback, model_at, tmp_path):
    loopback.says(GOOD)
    first = ask(model_at(cache=tmp_path))
    offline = model_at(cache=tmp_path, replay=True, base_url="http://127.0.0.1:9/v1", api_key="none")
    again = ask(offline)
    assert again.answer == first.answer
    assert again.replayed
    assert offline.usage == Usage(0, 1, 0, 0, None)
    assert len(loopback.requests) == 1


def test_the_key_is_in_no_recording_even_where_the_model_repeats_it(loopback, model_at, tmp_path):
    loopback.says(json.dumps({"name": "Flask", "volume": 1, "tags": [KEY]}))
    reply = ask(model_at(cache=tmp_path))
    assert reply.answer.tags == ["***"]
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) == 1
    assert all(KEY not in path.read_text() for path in files)
    assert re.fullmatch(r"[0-9a-f]{64}\.json", files[0].name)


def test_each_part_of_a_request_makes_it_another_one(loopback, model_at, tmp_path):
    loopback.says(GOOD)
    variants: list[tuple[dict[str, Any], tuple[Message, ...], str]] = [
        ({}, QUESTION, "flask/1"),
        ({}, QUESTION, "flask/2"),
        ({"model": "other"}, QUESTION, "flask/1"),
        ({"temperature": 0.1}, QUESTION, "flask/1"),
        ({"seed": 1}, QUESTION, "flask/1"),
        ({"max_tokens": 5}, QUESTION, "flask/1"),
        ({}, (*QUESTION, Message("user", "?")), "flask/1"),
        ({}, (QUESTION[0], Message("user", "Which?", (PNG,))), "flask/1"),
        ({}, (QUESTION[0], Message("user", "Which?", (PNG + b"1",))), "flask/1"),
    ]
    keys = [ask(model_at(cache=tmp_path, **fields), question, prompt).key for fields, question, prompt in variants]
    assert len(set(keys)) == len(variants) == len(loopback.requests)
    with model_at(cache=tmp_path) as model:

        class Other(Flask):
            mass: float = 1.0

        model.ask("flask/1", QUESTION, Other)
    assert len(loopback.requests) == len(variants) + 1


def test_a_request_that_is_not_recorded_is_named_and_nothing_is_sent(loopback, model_at, tmp_path):
    loopback.says(GOOD)
    error = failure(model_at(cache=tmp_path, replay=True))
    assert error.reason == "not_recorded"
    assert "flask/1" in str(error)
    assert str(tmp_path) in str(error)
    assert loopback.requests == []


def test_replay_without_a_folder_is_reported(model_at):
    with pytest.raises(LanguageModelError, match="LABGYM_LLM_CACHE"):
        model_at(replay=True)


def test_a_damaged_recording_is_reported_and_not_used(loopback, model_at, tmp_path):
    loopback.says(GOOD)
    key = ask(model_at(cache=tmp_path)).key
    file = next(tmp_path.rglob("*.json"))
    other = "0" * 64
    file.write_text(file.read_text().replace(key, other))
    with pytest.raises(DocumentError, match="another request"):
        ask(model_at(cache=tmp_path))
    file.write_text("{")
    with pytest.raises(DocumentError, match="not valid JSON"):
        ask(model_at(cache=tmp_path))


def test_an_answer_of_the_wrong_shape_is_repeated_offline_too_and_its_file_named(loopback, model_at, tmp_path):
    loopback.says("no JSON " * 5000)
    online, offline = failure(model_at(cache=tmp_path)), failure(model_at(cache=tmp_path, replay=True))
    assert online.reply == offline.reply
    assert str(next(tmp_path.rglob("*.json"))) in str(offline)


def test_half_a_surrogate_pair_in_a_reply_does_no_harm(loopback, model_at, tmp_path):
    loopback.says('{"name": "Flask", "volume": 1, "tags": ["\ud800"]}')
    assert ask(model_at(cache=tmp_path)).answer.tags == ["?"]


def test_the_environment_configures_a_model(monkeypatch, tmp_path):
    settings = {
        "BASE_URL": "http://127.0.0.1:8000/v1",
        "MODEL": "local",
        "API_KEY": KEY,
        "TIMEOUT": "12.5",
        "RETRIES": "0",
        "PRICE_IN": "0.5",
        "CACHE": str(tmp_path),
        "REPLAY": "1",
    }
    for name, value in settings.items():
        monkeypatch.setenv(f"LABGYM_LLM_{name}", value)
    config = LanguageModelConfig.from_environment()
    assert LanguageModelConfig.configured()
    assert (config.model, config.timeout, config.retries, config.price_in) == ("local", 12.5, 0, 0.5)
    assert config.cache == Path(tmp_path)
    assert config.replay
    assert KEY not in repr(config) + str(config) + config.model_dump_json()


def test_nothing_configured_is_reported_with_the_variables_to_set():
    assert not LanguageModelConfig.configured({})
    with pytest.raises(LanguageModelError, match="LABGYM_LLM_BASE_URL and LABGYM_LLM_MODEL") as caught:
        LanguageModelConfig.from_environment({})
    assert caught.value.reason == "not_configured"


@pytest.mark.parametrize(
    ("name", "value"),
    [("TIMEOUT", "soon"), ("RETRIES", "-1"), ("BASE_URL", "file:///etc/passwd"), ("BASE_URL", "http://u:p@host/v1")],
)
def test_a_variable_out_of_order_is_named_without_its_value(name, value):
    environment = {"LABGYM_LLM_BASE_URL": "http://host/v1", "LABGYM_LLM_MODEL": "m", f"LABGYM_LLM_{name}": value}
    with pytest.raises(DocumentError, match=f"LABGYM_LLM_{name}") as caught:
        LanguageModelConfig.from_environment(environment)
    assert value not in str(caught.value)


def test_the_error_survives_a_worker_process():
    error = pickle.loads(pickle.dumps(LanguageModelError("timeout", "too late", "half")))
    assert isinstance(error, LabgymError)
    assert (error.reason, error.reply, str(error)) == ("timeout", "half", "too late")


def test_a_recorded_run_needs_no_client_package_and_an_unrecorded_one_says_so(
    loopback, model_at, tmp_path, monkeypatch
):
    loopback.says(GOOD)
    ask(model_at(cache=tmp_path))
    monkeypatch.setitem(sys.modules, "labgym.llm.endpoint", None)
    assert ask(model_at(cache=tmp_path)).replayed
    with pytest.raises(MissingDependencyError, match=r"labgym-nav\[llm\]"):
        ask(model_at())
