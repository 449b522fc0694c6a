"""Parts of rows are the same in Python and in what is compiled."""

import numba
import numpy as np
import pytest

from phasmid.control.views import take

ROW = np.arange(200.0)


@pytest.mark.parametrize("kind", [np.float64, np.int64])
@pytest.mark.parametrize("shape", [(7,), (2, 5), (3, 4, 2), (2, 3, 4, 5)])
def test_a_part_is_the_same_where_it_is_compiled(shape, kind):
    """Every number, one that is written, and where the part ends."""

    @numba.njit
    def compiled(row, begin, legs):
        # One length is known to the compiler as a number, the others as variables.
        part, end = take(row, begin, (legs, *shape[1:]))
        part[-1] *= 2
        return part.copy(), part.size, end

    row, same = ROW.astype(kind), ROW.astype(kind)
    part, end = take(same, 11, shape)
    part[-1] *= 2
    told, size, told_end = compiled(row, 11, shape[0])
    np.testing.assert_array_equal(told, part)
    np.testing.assert_array_equal(row, same)
    assert (size, told_end) == (part.size, end)


@pytest.mark.parametrize("wrong", [ROW[::2], ROW.reshape(2, 100), "read-only"])
def test_what_is_no_row_to_be_written_is_refused_by_the_compiler(wrong):
    """An address and a shape would mean other numbers there."""
    if isinstance(wrong, str):
        wrong = ROW.copy()
        wrong.flags.writeable = False

    @numba.njit
    def compiled(row):
        return take(row, 1, (2,))[0].sum()

    with pytest.raises(numba.core.errors.TypingError, match="is no row"):
        compiled(wrong)
