"""The course's notebooks run as they stand, and their checks judge answers correctly."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
COURSE = ROOT / "docs/course"
NOTEBOOKS = sorted(COURSE.glob("[1-9]-*.md"))
CASES = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem != "2-gaits"))
    for path in NOTEBOOKS
]

pytestmark = pytest.mark.usefixtures("compiled_engine")


def cells(path):
    """Code cells of a notebook without their options, in order."""
    blocks = re.findall(r"```\{code-cell\} ipython3\n(.*?)```", path.read_text("utf-8"), re.DOTALL)
    return [re.sub(r"\A(:.*\n)+", "", block) for block in blocks]


@pytest.fixture(scope="module", params=CASES)
def notebook(request, tmp_path_factory):
    """Names of a notebook whose cells were executed in an empty folder; warnings are errors."""
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    names = {"__name__": "__main__"}
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings(), plt.rc_context():
        patch.chdir(tmp_path_factory.mktemp(request.param.stem))
        warnings.simplefilter("error")
        for number, code in enumerate(cells(request.param)):
            exec(compile(code, f"{request.param.name}, cell {number}", "exec"), names)
            for figure in map(plt.figure, plt.get_fignums()):
                figure.canvas.draw()
            plt.close("all")
    return names


def test_there_are_seven_notebooks_in_the_index():
    links = re.findall(
        r"^\| \[.*?\]\((.*?)\)", (COURSE / "index.md").read_text("utf-8"), re.MULTILINE
    )
    assert links == [path.name for path in NOTEBOOKS]
    assert len(links) == 7


def test_a_notebook_runs_without_answers_and_accepts_its_solutions(notebook):
    numbers = [name[-1] for name in notebook if name.startswith("check_")]
    assert len(numbers) >= 2
    for number in numbers:
        assert notebook[f"answer_{number}"] is None
        assert notebook[f"check_{number}"](notebook[f"solution_{number}"])


def test_checks_refuse_wrong_answers(notebook, capsys):
    for number in (name[-1] for name in notebook if name.startswith("check_")):
        check, right = notebook[f"check_{number}"], np.asarray(notebook[f"solution_{number}"])
        for wrong in (None, -right, 1.1 * right, 0.9 * right, 1000 * right):
            assert not check(wrong)
        words = capsys.readouterr().out
        assert words.count("No answer yet.") == 1
        assert words.count("Not yet.") == 4
