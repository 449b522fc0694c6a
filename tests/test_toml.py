"""TOML texts may come from anyone: each is read at bounded cost, or refused in one sentence."""

import tracemalloc
from pathlib import Path

import pytest

from phasmid import load_robot
from phasmid.cli import main
from phasmid.control.script import script_from_text
from phasmid.errors import InvalidInput
from phasmid.scenario import recorded_scenario
from phasmid.toml import parse_toml, read_toml

DIGITS = f"a = {'9' * 5000}"
NESTED = f"a = {'[' * 5000}"
DOTTED = f"{'a.' * 3000}a = 1"


@pytest.mark.parametrize(
    "text",
    [
        DOTTED,
        f"[{'a.' * 3000}a]",
        f"x = {{ {'a.' * 3000}a = 1 }}",
        f"{' . '.join(['a', repr('a'), chr(34) + 'a' + chr(34)] * 1000)} = 1",
    ],
)
def test_keys_of_many_parts_are_refused_before_they_cost_memory(text):
    # The parser keeps every beginning of a key: 3000² / 2 references of 8 bytes are 36 MB.
    tracemalloc.start()
    with pytest.raises(InvalidInput, match="line 2: a key has more than 16 parts"):
        parse_toml(f"# a.b\n{text}", "walk.toml")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1e6


def test_every_reader_of_toml_refuses_numbers_and_nesting_beyond_measure(tmp_path):
    def of_a_file(text):
        (tmp_path / "a.toml").write_text(text)
        read_toml(Path(tmp_path / "a.toml"))

    def of_a_recording(text):
        recorded_scenario({"robot": text, "scenario": "x"})

    for reader in (of_a_file, of_a_recording, script_from_text):
        with pytest.raises(InvalidInput, match="a number has too many digits"):
            reader(DIGITS)
        with pytest.raises(InvalidInput, match="nested too deeply"):
            reader(NESTED)
        with pytest.raises(InvalidInput, match="line 1: a key has more than 16 parts"):
            reader(DOTTED)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["walk", "--offsets", f"[{'9' * 5000}]"], "it must be a number."),
        (["walk", "--offsets", "[" * 5000], "it must be a number."),
        (["walk", "--duration", "9" * 400], "--duration is inf; it must be a finite number"),
        (["walk", "--legs", "9" * 5000], "it must be leg numbers with commas between."),
        (["gaits", "--lost", "9" * 5000], "it must be leg numbers with commas between."),
    ],
)
def test_numbers_and_lists_beyond_measure_are_no_options(arguments, said, capsys):
    assert main(arguments) == 2
    assert said in capsys.readouterr().err


def test_what_all_legs_share_is_bounded_since_each_leg_gets_a_copy(tmp_path):
    shared = "\n".join(f"k{i} = 1" for i in range(2000))
    (tmp_path / "a.toml").write_text(f"[leg]\n{shared}\n[legs.x]\n")
    with pytest.raises(InvalidInput, match="leg has more than 1000 values"):
        load_robot(tmp_path / "a.toml")
    legs = "\n".join(f"[legs.k{i}]" for i in range(1000))
    (tmp_path / "a.toml").write_text(f"[leg]\nfemur_mm = 1\n{legs}\n")
    with pytest.raises(InvalidInput, match="1000 legs are given; at most 100 are possible"):
        load_robot(tmp_path / "a.toml")
