"""The recorder, and the source that it leaves."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from phasmid.batch import compiled, generated
from phasmid.batch.recorder import Number, Tape


def test_the_generated_source_is_that_of_todays_equations() -> None:
    # If this fails: python -m phasmid.batch.generate. In a process of its own, since the tests'
    # type checker lets no recorded number pass for a float.
    code = "from phasmid.batch.generate import generated_source\nprint(generated_source(), end='')"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert Path(generated.__file__).read_text() == run.stdout


def test_equal_expressions_are_one_number() -> None:
    tape = Tape()
    x, y = tape.input("x", varies=True), tape.input("y", varies=True)
    assert x * y + 1 is y * x + 1.0
    assert np.cos(x + y) is np.cos(y + x)
    assert x - y is not y - x


def test_nothing_is_added_to_zero_or_multiplied_by_zero_or_one() -> None:
    tape = Tape()
    x, y = tape.input("x", varies=True), tape.input("y", varies=True)
    assert x * 0 + y is y
    assert 1.0 * x is x
    assert x * -1 is -x
    negative = -x
    assert -negative is x
    assert x + -y is x - y
    assert 0 - x is -x
    assert (-x) * y is -(x * y)
    assert (x / 2) is x * 0.5
    assert (x / 3).op == "/"
    assert (tape.constant(2.0) * 3 - 1).args == (5.0,)


def test_arrays_of_recorded_numbers_compute_entry_by_entry() -> None:
    tape = Tape()
    x, y = tape.input("x", varies=True), tape.input("y", varies=True)
    v = np.array([x, y], dtype=object)
    assert list(np.float64(2.0) * v) == [2 * x, 2 * y]
    assert list(x * v) == [x * x, x * y]
    assert list(v**2) == [x * x, y * y]
    assert np.sum(v) is x + y
    assert isinstance(np.arctan2(x, 1.0), Number)
    assert isinstance(np.maximum(x, 0.0), Number)


def test_the_file_that_numba_watches_changes_with_how_it_is_compiled() -> None:
    # numba's cache knows a kernel by the size and the time of the file of its code. Options and
    # prefetch stand in another file, whose fingerprint that one carries.
    how = Path(compiled.__file__).read_text(encoding="utf-8")
    assert hashlib.sha256(how.encode()).hexdigest() in Path(generated.__file__).read_text()
    code = compiled.machine_code("foot_position").py_func.__code__
    assert Path(code.co_filename) == Path(generated.__file__)


@pytest.mark.parametrize("why_not", ["", "absent", "disabled"])
def test_numba_is_loaded_when_first_needed_and_may_be_absent(why_not: str) -> None:
    code = (
        "import sys\n"
        + ("sys.modules['numba'] = None\n" if why_not == "absent" else "")
        + "import phasmid, numpy as np\n"
        "from phasmid import batch, dynamics\n"
        "assert not sys.modules.get('numba')\n"
        "leg = phasmid.load_robot('phantomx-paper').legs[0]\n"
        "q = np.full((5000, 3), 0.4)\n"
        "ours, theirs = (f(leg, q, q, q) for f in (batch.leg_torque, dynamics.leg_torque))\n"
        "assert abs(ours - theirs).max() < 1e-12\n"
        "print(batch.backend())\n"
    )
    # With NUMBA_DISABLE_JIT numba leaves Python's loops as they are.
    env = os.environ | ({"NUMBA_DISABLE_JIT": "1"} if why_not == "disabled" else {})
    run = subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
    )
    assert run.stdout.startswith("NumPy" if why_not else "numba ")
    assert not run.stderr


def test_where_no_cache_can_be_written_the_kernels_are_compiled_each_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # numba raises RuntimeError where it finds no folder for its cache.
    module = compiled.numba()
    assert module is not None
    njit = module.njit

    def without_cache(*args: object, cache: bool = False, **options: object) -> object:
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return njit(*args, **options)

    monkeypatch.setattr(module, "njit", without_cache)
    kernel = compiled.machine_code.__wrapped__("foot_position")
    k, out = np.array([[0.0, 1.0, 2.0]]), np.zeros(3)
    one, three = np.uint64(1), np.uint64(3)
    assert kernel(k, np.zeros(3), three, out, three, np.uint64(0), one) == 1
    # A leg of lengths 0, 1 and 2, stretched along x.
    np.testing.assert_array_equal(out, [3.0, 0.0, 0.0])
