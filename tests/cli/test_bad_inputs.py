"""Bad inputs of each kind end with one sentence and status 2; `make slow` has all of them."""

import pytest

from phasmid.cli import main
from support.bad_inputs import bad_inputs, refused_rightly

CHOSEN = (
    "robot toml: nan length",
    "robot toml: hexadecimal beyond floats",
    "robot toml: values times legs",
    "robot toml: limits of many turns",
    "robot toml: length of a planet",
    "robot toml: mass of an atom",
    "robot toml: servo of a planet",
    "robot toml: servo of an atom",
    "urdf: limits the wrong way round",
    "urdf: a mass of text",
    "urdf: deep",
    "mjcf: limits the wrong way round",
    "mjcf: includes itself",
    "step: sidecar of digits",
    "scenario: patches of text",
    "scenario: 20 000 tables",
    "scenario: 100 000 keys",
    "scenario: a coordinate beyond robots",
    "gait: never three feet",
    "commands: 50 m/s",
    "commands: nan",
    "height map a.csv: beyond single floats",
    "height map a.npy: claims much",
    "trajectory a.csv: milliseconds since 1970",
    "trajectory a.csv: a heading alone",
    "log: a heading alone, own",
    "log: a heading alone, exported",
    "log: a heading alone, exported, to walk",
    "log: a heading alone, bench",
    "recording a.nc: a flipped bit, report",
    "recording: report a.nc into 1500 folders",
    "recording: plot a.nc all into 1500 folders",
    "recording: export a.nc into 1500 folders",
    "recording: compare a.nc into 1500 folders",
    "recording: an unknown channel",
    "options: drive --velocity 0.1,0,0 --fault x",
    "options: walk --damping 1e300",
    "options: walk --contact-law simscape --stiffness 1e-300",
    "options: walk --stiffness 1e9",
    "options: walk --friction-damping 5e-324",
    "options: walk --terrain rough --rough-length-mm 1e-300",
    "options: drive --waypoints 1,0,1e300",
    "options: export-firmware --out walk.txt",
    "options: export-firmware --terrain stairs",
)


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    return {one.name: one for one in bad_inputs(tmp_path_factory.mktemp("whole"))}


@pytest.mark.parametrize("name", CHOSEN)
def test_bad_input_ends_with_one_sentence_and_status_2(name, known, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for file, content in known[name].files.items():
        (tmp_path / file).write_bytes(content)
    status = main(list(known[name].arguments))
    assert refused_rightly(status, capsys.readouterr().err)


LIBRARIES = ("a.csv: not utf-8", "a.npy: cut off", "a.nc: text")


@pytest.mark.parametrize("name", [f"trajectory {one}" for one in LIBRARIES])
def test_a_refusal_does_not_repeat_a_library_s_words(name, known, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for file, content in known[name].files.items():
        (tmp_path / file).write_bytes(content)
    assert main(list(known[name].arguments)) == 2
    first, *_ = capsys.readouterr().err.splitlines()
    assert first.endswith(("not a table of text.", "that can be read."))
