"""Bad inputs of each kind end with one sentence and status 2, as commands in this process."""

from phasmid.cli import main
from support.bad_inputs import bad_inputs, refused_rightly


def test_bad_input_ends_with_one_sentence_and_status_2(tmp_path, monkeypatch, capsys):
    for number, one in enumerate(bad_inputs(tmp_path)):
        (tmp_path / str(number)).mkdir()
        monkeypatch.chdir(tmp_path / str(number))
        for file, content in one.files.items():
            (tmp_path / str(number) / file).write_bytes(content)
        status, printed = main(list(one.arguments)), capsys.readouterr().err
        assert refused_rightly(status, printed), (one.name, status, printed[:500])
