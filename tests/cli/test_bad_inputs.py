"""Bad inputs of each kind end with one sentence and status 2, as commands in this process."""

import pytest

from phasmid.cli import main
from support.bad_inputs import KINDS, bad_inputs, refused_rightly

LIBRARIES = [f"trajectory {one}" for one in ("a.csv: not utf-8", "a.npy: cut off", "a.nc: text")]


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
