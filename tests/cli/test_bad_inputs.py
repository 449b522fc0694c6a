"""Bad inputs of each kind end with one sentence and status 2, as commands in this process."""

import pytest

from phasmid.cli import main
from support.bad_inputs import KINDS, bad_inputs, refused_rightly

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
    "recording: report a.nc --figures all into 1500 folders",
    "recording: export a.nc into 1500 folders",
    "recording: identify --compare a.nc into 1500 folders",
    "recording: an unknown channel",
    "options: drive --velocity 0.1,0,0 --fault x",
    "options: walk --damping 1e300",
    "options: walk --contact-law simscape --stiffness 1e-300",
    "options: walk --stiffness 1e9",
    "options: walk --friction-damping 5e-324",
    "options: walk --terrain rough --rough-length-mm 1e-300",
    "options: drive --waypoints 1,0,1e300",
    "options: export --out walk.txt",
    "options: export --out walk.h --terrain stairs",
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return tmp_path_factory.mktemp("whole")


@pytest.mark.parametrize("kind", KINDS)
def test_bad_input_ends_with_one_sentence_and_status_2(kind, whole, tmp_path, monkeypatch, capsys):
    for number, one in enumerate(bad_inputs(whole, [kind])):
        (tmp_path / str(number)).mkdir()
        monkeypatch.chdir(tmp_path / str(number))
        for file, content in one.files.items():
            (tmp_path / str(number) / file).write_bytes(content)
        status, printed = main(list(one.arguments)), capsys.readouterr().err
        assert refused_rightly(status, printed), (one.name, status, printed[:500])
        if one.name in LIBRARIES:
            # A library's own words would name its functions and types.
            first, *_ = printed.splitlines()
            assert first.endswith(("not a table of text.", "that can be read.")), one.name
