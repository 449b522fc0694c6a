"""What a browser says is held against what can be said: W6 and W7."""

import base64
import json

import pytest

from phasmid.studio.messages import (
    Bench,
    Change,
    Keep,
    Limb,
    Load,
    Pace,
    Play,
    Push,
    Record,
    Stick,
)
from phasmid.studio.parsing import read_request
from phasmid.studio.strict import DEEPEST, MOST_MARKS, Misunderstood, read_json


def refused(text):
    with pytest.raises(Misunderstood) as error:
        read_request(text)
    return error.value


@pytest.mark.parametrize(
    ("told", "request_"),
    [
        ({"do": "stick", "at": [1, -0.5, 0]}, Stick((1.0, -0.5, 0.0))),
        ({"do": "stick", "at": [1e9, -7, 0.25]}, Stick((1.0, -1.0, 0.25))),
        ({"do": "change", "name": "gait", "value": "wave"}, Change("gait", "wave")),
        ({"do": "change", "name": "friction", "value": 1}, Change("friction", 1.0)),
        ({"do": "change", "name": "ground_sensing", "value": True}, Change("ground_sensing", True)),
        ({"do": "play", "how": "step"}, Play("step")),
        ({"do": "pace", "factor": 0.25}, Pace(0.25)),
        ({"do": "push", "impulse": [0, 1.5, 0]}, Push((0.0, 1.5, 0.0))),
        ({"do": "limb", "leg": 3, "how": "lose"}, Limb(3, "lose")),
        ({"do": "record", "on": False}, Record(False)),
        ({"do": "keep", "what": "link"}, Keep("link")),
        (
            {"do": "load", "what": "robot", "name": "<script>.toml", "content": "aGk="},
            Load("robot", "<script>.toml", b"hi"),
        ),
        ({"do": "bench", "leg": 1}, Bench(1)),
        (
            {"do": "bench", "leg": 2, "foot": [0.1, 0, -0.1], "angles": None, "force": [0, 0, 9]},
            Bench(2, None, (0.1, 0.0, -0.1), (0.0, 0.0, 9.0)),
        ),
    ],
)
def test_every_request_is_read(told, request_):
    assert read_request(json.dumps({"id": 7} | told)) == (7, request_)


def test_a_request_keeps_its_kinds():
    # 1 == True and 1 == 1.0, which the comparison above does not tell apart.
    value = read_request('{"id": 1, "do": "change", "name": "x", "value": 1}')[1].value
    assert isinstance(value, float)
    value = read_request('{"id": 1, "do": "change", "name": "x", "value": true}')[1].value
    assert value is True


def test_only_a_stick_needs_no_number():
    assert read_request('{"do": "stick", "at": [0, 0, 0]}') == (None, Stick((0.0, 0.0, 0.0)))
    error = refused('{"do": "play", "how": "play"}')
    assert (error.status, error.what) == (422, "id is missing; it must be a whole number.")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "message line 1, column 1: expecting value."),
        ("hello", "message line 1, column 1: expecting value."),
        ('{"id": 1,\n "do"}', "message line 2, column 6: expecting ':' delimiter."),
        ('{"id": 1} x', "message line 1, column 11: extra data."),
        ('{"id": 1', "message line 1, column 9: expecting ',' delimiter."),
        ('{"id": "\n"}', "message line 1, column 9: invalid control character at."),
        ('{"do": "pace", "factor": NaN}', "NaN is no finite number."),
        ('{"do": "pace", "factor": -Infinity}', "-Infinity is no finite number."),
        ('{"do": "pace", "factor": 1e999}', "1e999 is no finite number."),
        ('{"id": 1, "do": "play", "do": "pace"}', 'key "do" is given twice.'),
        ('{"a": {"b": 1, "b": 1}}', 'key "b" is given twice.'),
        ('"text"', "the message is text; it must be a table."),
        ("[1, 2]", "the message is a list; it must be a table."),
        ("null", "the message is null; it must be a table."),
        (b'{"id": 1}', "the message is bytes; it must be text."),
        ('{"id": 1, "do": "palse"}', 'no command "palse".'),
        ('{"id": 1, "do": "play", "how": "play", "hwo": 1}', 'unknown key "hwo" in "play".'),
        (
            '{"id": 1, "do": "play", "__class__": 1, "how": "play"}',
            'unknown key "__class__" in "play".',
        ),
    ],
)
def test_w6_what_is_no_request_is_refused_with_its_place(text, said):
    error = refused(text)
    assert (error.status, error.what) == (400, said)


def test_w6_names_that_are_near_are_suggested():
    assert refused('{"id": 1, "do": "plya"}').hint == "play"
    assert refused('{"id": 1, "do": "play", "hwo": "play"}').hint == "how"
    assert refused('{"id": 1, "do": "play", "how": "puase"}').hint == "pause"


@pytest.mark.parametrize("depth", [DEEPEST + 1, 5000])
@pytest.mark.parametrize("mark", ["[", '{"a":'])
def test_w6_what_is_too_deep_is_refused_by_its_line(depth, mark):
    error = refused("\n" + depth * mark)
    assert error.status == 400
    assert error.what == f"message line 2: more than {DEEPEST} lists and tables in one another."


def test_w6_brackets_in_texts_are_no_brackets():
    text = json.dumps({"a": 50 * '[{"\\'})
    assert read_json(text) == {"a": 50 * '[{"\\'}
    assert read_json(DEEPEST * "[" + DEEPEST * "]")


@pytest.mark.parametrize(
    "text",
    [
        '"' + 5_000_000 * '\\"',
        '{"a": "' + 9_000_000 * "[" + '"}',
        "[" + 3_000_000 * "[],",
        9_000_000 * '"',
        9_000_000 * "1",
        "[" + 9_000_000 * " ",
        "1e" + 9_000_000 * "0",
        "0." + 9_000_000 * "1",
    ],
    ids=["escapes", "text", "lists", "quotes", "digits", "blanks", "exponent", "fraction"],
)
def test_w6_what_could_take_long_to_read_is_refused(text):
    # Each character is looked at a few times. Once for each of its marks, these would take hours.
    assert refused(text).status in (400, 422)


def test_w6_a_message_has_a_bounded_number_of_parts():
    said = refused(json.dumps({"a": MOST_MARKS * [""]})).what
    assert said == f"the message has more than {MOST_MARKS} texts and brackets."


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"do": 3}, "do is a number; it must be one of stick, change, play"),
        ({"do": None}, "do is null; it must be one of stick"),
        ({"x": 1}, "do is missing; it must be one of stick"),
        ({"do": "pace"}, 'factor is missing; "pace" needs it.'),
        ({"do": "pace", "factor": "fast"}, "factor is text; it must be a number."),
        ({"do": "pace", "factor": True}, "factor is true; it must be a number."),
        ({"do": "pace", "factor": None}, "factor is null; it must be a number."),
        ({"do": "push", "impulse": 3}, "impulse is a number; it must be a list of 3 numbers."),
        ({"do": "push", "impulse": [0, "a", 0]}, "impulse[1] is text; it must be a number."),
        ({"do": "push", "impulse": [0, 0]}, "impulse has 2 values; it must have 3."),
        ({"do": "push", "impulse": [0]}, "impulse has 1 value; it must have 3."),
        ({"do": "stick", "at": [0, 0, {}]}, "at[2] is a table; it must be a number."),
        ({"do": "play", "how": 1}, "how is a number; it must be one of play, pause, step, reset."),
        ({"do": "play", "how": "x"}, 'how is "x"; it must be one of play, pause, step, reset.'),
        ({"do": "limb", "leg": 0, "how": "lose"}, "leg is 0; it must be a whole number 1 or more."),
        ({"do": "limb", "leg": 1.5, "how": "lose"}, "leg is 1.5; it must be a whole number"),
        ({"do": "limb", "leg": True, "how": "lose"}, "leg is true; it must be a whole number."),
        ({"do": "record", "on": 1}, "on is a number; it must be true or false."),
        ({"do": "change", "name": 1, "value": 1}, "name is a number; it must be text."),
        ({"do": "change", "name": "a", "value": [1]}, "value is a list; it must be a number, text"),
        ({"do": "change", "name": "a", "value": 2000 * "x"}, "value has 2000 characters"),
        ({"do": "change", "name": "a", "value": "\ud800"}, "value holds half a character."),
        ({"do": "bench", "leg": 1, "force": None}, "force is null; it must be a list of 3"),
    ],
)
def test_w7_a_field_of_the_wrong_kind_is_named_by_its_path(told, said):
    error = refused(json.dumps({"id": 7} | told))
    assert (error.status, error.id) == (422, 7)
    assert error.what.startswith(said)
    assert error.what.endswith(".")


@pytest.mark.parametrize("number", ["1", 1.5, True, [], -1, 2**53 + 1, 10**30])
def test_w7_the_number_of_a_message_is_a_whole_one(number):
    error = refused(json.dumps({"id": number, "do": "play", "how": "play"}))
    assert (error.status, error.id) == (422, None)
    assert error.what.startswith("id is ")


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        "../x.toml",
        "/etc/passwd",
        "a\\b.toml",
        "C:x.toml",
        "a\x00.toml",
        "a\n",
        "\u202e",
    ],
)
def test_a_file_has_a_name_and_no_folder(name):
    told = {"id": 1, "do": "load", "what": "robot", "name": name, "content": ""}
    error = refused(json.dumps(told))
    assert error.status == 422
    assert error.what.startswith("name is ")
    assert error.what.isprintable()


@pytest.mark.parametrize("content", ["*", "abc", "aGk=\n", "a Gk=", "ä", "aGk=aGk="])
def test_bytes_come_in_base64(content):
    told = {"id": 1, "do": "load", "what": "robot", "name": "a", "content": content}
    assert refused(json.dumps(told)).what == "content is no base64."


def test_a_file_of_any_bytes_is_read():
    content = bytes(range(256))
    told = {"id": 1, "do": "load", "what": "terrain", "name": "a.png"}
    told["content"] = base64.b64encode(content).decode()
    assert read_request(json.dumps(told))[1].content == content
