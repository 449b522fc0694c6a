"""The trunk's motion as a value that cannot be wrong."""

from __future__ import annotations

import numpy as np
import pytest

from phasmid.dynamics import BodyMotion
from phasmid.errors import InvalidInput

ZERO = np.zeros(3)


def test_its_numbers_cannot_be_changed_from_outside() -> None:
    position = np.zeros(3)
    body = BodyMotion.at_rest(position)
    position[0] = 1.0
    assert body.position[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        body.position[0] = 1.0


@pytest.mark.parametrize(
    "matrix", [np.diag([1.0, 1.0, 1.1]), np.diag([1.0, 1.0, -1.0])], ids=["stretched", "mirrored"]
)
def test_a_matrix_that_is_no_rotation_is_refused(matrix: np.ndarray) -> None:
    with pytest.raises(InvalidInput, match="rotation is not a rotation"):
        BodyMotion.at_rest(ZERO, matrix)


def test_a_number_that_is_not_finite_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"position\[1\] is nan; it must be finite"):
        BodyMotion.at_rest(np.array([0.0, np.nan, 0.0]))
