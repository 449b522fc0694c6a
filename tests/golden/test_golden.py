"""Every answer that phasmid gives in the golden cases is the stored one; see `golden.figures`."""

import sys
from pathlib import Path

import numpy as np
import pytest

from golden.comparing import compare
from golden.figures import differences, figures
from golden.running import Answers, Channel, Names, answer, case_names, load_case

OWN_NAMES = Path(__file__).parent / "renamed.toml"
"""Names of this version, where the cases have others."""

TIME = np.arange(20.0)


@pytest.mark.usefixtures("compiled_engine")
@pytest.mark.parametrize("name", case_names())
def test_a_case_answers_as_stored(name):
    if sys.platform == "win32" and load_case(name)["run"] == "page":
        pytest.skip("Ctrl-C cannot be sent to one process on Windows")
    assert differences(name, answer(name, OWN_NAMES)) == []


def of(values, time=TIME, dims=("time", "leg")):
    answers = Answers()
    answers.channels["run.torque"] = Channel(dims, values, time)
    return answers


def test_figures_tell_exchanged_legs_apart():
    # The weights of the samples differ from entry to entry; rms and maximum do not see it.
    values = np.random.default_rng(0).normal(size=(20, 6))
    there = figures(Channel(("time", "leg"), values, TIME))
    exchanged = figures(Channel(("time", "leg"), values[:, [1, 0, 2, 3, 4, 5]], TIME))
    assert there[:3] == pytest.approx(exchanged[:3], rel=1e-14)
    assert np.abs(np.array(there[3:]) - exchanged[3:]).min() > 0


def test_versions_are_compared_bit_by_bit_with_time_and_size():
    values = np.random.default_rng(0).normal(size=(20, 6))
    changed = values.copy()
    changed[7:, 2] = np.nextafter(changed[7:, 2], np.inf)
    assert compare(of(values), of(values.copy())) == []
    (line,) = compare(of(changed), of(values))
    assert line.startswith("run.torque: differs from 7 s on, at most ")
    assert compare(of(values), Answers()) == ["channel run.torque: only here"]
    # A run that ends sooner is compared up to there.
    (line,) = compare(of(changed[:15], TIME[:15]), of(values))
    assert line.startswith("run.torque: differs from 7 s on")
    assert "shape (15, 6)" in line
    assert "dimensions" in compare(of(values), of(values, dims=("time", "joint")))[0]
    # Absent values are equal to absent ones, and to nothing else.
    changed[3:] = np.nan
    assert compare(of(changed), of(changed.copy())) == []
    assert compare(of(changed), of(values))[0].startswith("run.torque: differs from 3 s on")


def test_a_version_is_run_and_read_in_its_own_words(tmp_path):
    file = tmp_path / "renamed.toml"
    file.write_text(
        '[commands]\nwalk = "run walk"\n[options]\ndt = "time-step"\n'
        '[channels]\njoint_torque = "tau"\n[keys]\nahead_mm_per_s = "vx_mm_per_s"\n'
        '[events]\n"leg is lost" = "leg is out"\n'
    )
    names = Names(file)
    assert names.command_line("walk --dt 0.001") == ["run", "walk", "--time-step", "0.001"]
    assert names.from_version("channels", "tau") == "joint_torque"
    assert names.command_file("ahead_mm_per_s = 5") == "vx_mm_per_s = 5"
    assert names.sentence("its leg is out.") == "its leg is lost."
    assert names.options({"dt": 0.1, "kind": "x"}) == {"time-step": 0.1, "kind": "x"}


def test_a_small_number_of_a_text_file_does_not_change_unnoticed():
    # Of 1000 numbers up to 10 the one of 1e-4 grows by 1 %: its logarithm by 0.01, the weighted
    # mean by 1e-5. The least tolerance is 1e-9 of ln(1e10) = 23.
    numbers = np.full(1000, 10.0)
    numbers[500] = 1e-4
    before = figures(Channel(("number",), numbers))
    numbers[500] *= 1.01
    after = figures(Channel(("number",), numbers))
    assert abs(after[-1] - before[-1]) > 100 * 1e-9 * before[2]
