"""Messages of a browser are read as they are meant, or refused in one sentence."""

import base64
import json
import time

import pytest

from phasmid.studio.messages import (
    Bench,
    Change,
    InvalidMessage,
    Keep,
    Limb,
    Load,
    Pace,
    Play,
    Push,
    Record,
    Stick,
    read_request,
)


def refused(text):
    with pytest.raises(InvalidMessage) as error:
        read_request(text)
    assert error.value.what.endswith(".")
    assert len(error.value.what) < 500
    return error.value


@pytest.mark.parametrize(
    ("told", "request_"),
    [
        ({"do": "stick", "at": [1, -0.5, 0]}, Stick(at=(1.0, -0.5, 0.0))),
        ({"do": "change", "name": "gait", "value": "wave"}, Change(name="gait", value="wave")),
        ({"do": "play", "how": "step"}, Play(how="step")),
        ({"do": "pace", "factor": 0.25}, Pace(factor=0.25)),
        ({"do": "push", "impulse": [0, 1.5, 0]}, Push(impulse=(0.0, 1.5, 0.0))),
        ({"do": "limb", "leg": 3, "how": "lose"}, Limb(leg=3, how="lose")),
        ({"do": "record", "on": False}, Record(on=False)),
        ({"do": "keep"}, Keep()),
        (
            {"do": "load", "what": "terrain", "name": "<script>.png", "content": "aGk="},
            Load(what="terrain", name="<script>.png", content=b"hi"),
        ),
        ({"do": "bench", "leg": 1}, Bench(leg=1)),
        (
            {"do": "bench", "leg": 2, "foot": [0.1, 0, -0.1], "angles": None, "force": [0, 0, 9]},
            Bench(leg=2, foot=(0.1, 0.0, -0.1), force=(0.0, 0.0, 9.0)),
        ),
    ],
)
def test_every_request_is_read(told, request_):
    assert read_request(json.dumps(told)) == request_
    assert read_request(json.dumps({"id": 7} | told)).id == 7


def test_a_value_keeps_its_kind():
    # 1 == True and 1 == 1.0, which the comparison above does not tell apart.
    number = read_request('{"id": 1, "do": "change", "name": "x", "value": 1}').value
    assert isinstance(number, float)
    assert read_request('{"id": 1, "do": "change", "name": "x", "value": true}').value is True


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the message is no JSON: EOF while parsing a value at line 1 column 0."),
        ('{"id": 1,\n "do"}', "the message is no JSON: expected `:` at line 2 column 6."),
        (5000 * "[", "the message is no JSON: recursion limit exceeded"),
        (b"\xff", "the message is no JSON: "),
        ('{"do": "\\ud800"}', "the message is no JSON: "),
        ('{"id": 1, "do": "pace", "factor": NaN}', "factor is nan; it must be a finite number"),
        ('{"id": 1, "do": "pace", "factor": 1e999}', "factor is inf; it must be a finite number"),
        ("[1, 2]", "the message must be a table."),
        ("null", "the message must be a table."),
    ],
)
def test_what_is_no_json_is_refused_with_its_place(text, said):
    assert refused(text).what.startswith(said)


@pytest.mark.parametrize(
    ("told", "said", "hint"),
    [
        ({"do": "plya"}, "do must be one of stick, change, play, pace", "play"),
        ({"do": 3}, "do must be one of stick", ""),
        ({"x": 1}, "do must be one of stick", ""),
        ({"do": "play", "hwo": "play"}, 'unknown key "hwo".', '"how"'),
        ({"do": "play", "how": "play", "__class__": 1}, 'unknown key "__class__".', None),
        ({"do": "play", "how": "puase"}, 'how is "puase"; it must be "play", "pause"', '"pause"'),
        ({"do": "pace"}, "factor is missing.", None),
        ({"do": "pace", "factor": "fast"}, 'factor is "fast"; it must be a number', ""),
        ({"do": "pace", "factor": True}, "factor is true; it must be a number", ""),
        ({"do": "pace", "factor": 0}, "factor is 0; it must be 0.05 or more and 10 or less.", ""),
        ({"do": "push", "impulse": 3}, "impulse is 3; it must be a list.", ""),
        ({"do": "push", "impulse": [0, "a", 0]}, 'impulse[1] is "a"; it must be a number.', ""),
        ({"do": "push", "impulse": [0, 0]}, "impulse[2] is missing.", None),
        ({"do": "limb", "leg": 0, "how": "lose"}, "leg is 0; it must be 1 or more.", ""),
        ({"do": "limb", "leg": 1.5, "how": "lose"}, "leg is 1.5; it must be a whole number", ""),
        ({"do": "record", "on": 1}, "on is 1; it must be true or false.", ""),
        ({"do": "change", "name": 1, "value": 1}, "name is 1; it must be text.", ""),
        ({"do": "change", "name": 2000 * "x", "value": 1}, 'name is "xxx', None),
        ({"do": "change", "name": "a", "value": [1]}, "value is [1]; it must be a number.", ""),
        ({"do": "load", "what": "terrain", "name": "a", "content": "*"}, "content must be byt", ""),
        ({"do": "bench", "leg": 1, "foot": [0, 0, 11]}, "foot[2] is 11; it must be 10 or le", ""),
        ({"do": "bench", "leg": 1, "force": None}, "force is empty; it must be a list.", ""),
    ],
)
def test_a_wrong_field_is_named_and_the_nearest_word_suggested(told, said, hint):
    error = refused(json.dumps({"id": 7} | told))
    assert error.id == 7
    assert error.what.startswith(said)
    assert hint is None or error.hint == hint


@pytest.mark.parametrize("number", ["1", 1.5, True, [], -1, 2**53 + 1, 10**30])
def test_the_number_of_a_message_is_a_whole_one(number):
    told = {"id": number, "do": "play", "how": "play"}
    assert refused(json.dumps(told)).what.startswith("id is ")


MEGABYTES = 9_000_000
MANY = {f"key{number}": 1 for number in range(500_000)}


@pytest.mark.parametrize(
    "told",
    [
        {"id": 7, "do": "play", "h" * MEGABYTES: 1},
        {"id": 7, "do": "play", "how": "p" * MEGABYTES},
        {"id": 7, "do": "p" * MEGABYTES},
        {"id": 7, "do": "play"} | MANY,
        {"id": 7, "do": "load", "what": "terrain", "name": "a.csv", "content": "aGk="} | MANY,
        {"id": 7, "do": "push", "impulse": list(range(1_000_000))},
        [MANY],
    ],
    ids=["key", "word", "do", "keys", "keys beside content", "list", "nested"],
)
def test_only_the_content_of_a_file_may_be_large(told):
    text = json.dumps(told)
    begin = time.monotonic()
    error = refused(text)
    # Milliseconds, where validation and a search for the nearest name took seconds.
    assert time.monotonic() - begin < 0.5
    assert error.what.endswith("kB; the limit is 10 kB, except for the content of a file.")
    assert error.status == 413


@pytest.mark.parametrize("separators", [(",", ":"), (", ", ": ")])
def test_a_large_file_is_read_and_its_faults_are_named_in_time(separators):
    content = bytes(range(256)) * 27_000
    told = {"id": 7, "do": "load", "what": "terrain", "name": "a.npy"}
    told["content"] = base64.b64encode(content).decode()
    assert read_request(json.dumps(told, separators=separators)).content == content
    begin = time.monotonic()
    for changes, what in (
        ({"do": "play"}, 'unknown key "what"'),
        ({"k" * 5000: 1}, 'unknown key "kkk'),
        ({"content": 4_000_000 * "**"}, "content must be bytes in base64."),
        ({"content": 4_000_000 * "é"}, "content must be bytes in base64."),
        ({"content": {"content": told["content"]}}, "content is a table; "),
    ):
        assert refused(json.dumps(told | changes, ensure_ascii=False)).what.startswith(what)
    assert time.monotonic() - begin < 2
