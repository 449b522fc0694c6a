"""How a load moves from foot to foot."""

import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.forces import load_share
from phasmid.gait import HEXAPOD_GAITS


@pytest.mark.parametrize("gait", HEXAPOD_GAITS.values(), ids=list(HEXAPOD_GAITS))
def test_the_share_is_half_at_each_event_and_whole_outside_the_windows(gait):
    # The ramp x^3 (10 - 15 x + 6 x^2) is 1/2 at x = 1/2; events are exact to round-off of phases,
    # 1e-15, times the ramp's slope of 15/8 over the window's part of the cycle, 0.05.
    period, window = 2.0, 0.1
    for leg, offset in enumerate(gait.offsets):
        lift, land = offset * period, (offset + gait.swing_fraction) * period
        at = lambda t, leg=leg: load_share(gait, np.array(t), period=period, window=window)[leg]  # noqa: E731
        assert at(lift) == pytest.approx(0.5, abs=1e-12)
        assert at(land) == pytest.approx(0.5, abs=1e-12)
        assert at(lift - 0.0501) == at(land + 0.0501) == 1.0
        assert at(lift + 0.0501) == at(land - 0.0501) == 0.0
        assert at(lift - 0.02) == pytest.approx(1 - at(lift + 0.02), abs=1e-12)
        # x = 0.3: 0.027 * (10 - 4.5 + 0.54).
        assert at(land - 0.02) == pytest.approx(0.16308, abs=1e-12)


@pytest.mark.parametrize("window", [0.2, -0.1, float("nan")])
def test_a_window_that_the_gait_has_no_room_for_is_refused(window):
    words = rf"takes {window:g} s; it must take between 0 and 0\.1667 s, half of the shorter of st"
    with pytest.raises(InvalidInput, match=words) as caught:
        load_share(HEXAPOD_GAITS["wave"], np.zeros(1), period=2.0, window=window)
    assert caught.value.hint == "load_transfer = 0.166"
