"""Every answer that phasmid gives in the golden cases is the stored one; see `golden.figures`."""

import numpy as np
import pytest

from golden.comparing import compare
from golden.figures import differences, figures
from golden.running import Answers, Channel, Names, answer, case_names

TIME = np.arange(20.0)


@pytest.mark.usefixtures("compiled_engine")
@pytest.mark.parametrize("name", case_names())
def test_a_case_answers_as_stored(name):
    assert differences(name, answer(name)) == []


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
    assert names.here("channels", "tau") == "joint_torque"
    assert names.command_file("ahead_mm_per_s = 5") == "vx_mm_per_s = 5"
    assert names.sentence("its leg is out.") == "its leg is lost."
