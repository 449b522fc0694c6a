"""Protocol arithmetic against sums by hand, and control tables against themselves."""

import pytest

from phasmid.errors import InvalidInput
from phasmid.hardware import achievable_rate, exchange_time, model, models, read_time, write_time


def test_an_exchange_has_wire_time_return_delay_and_latency():
    # Read of 2 bytes of an AX: 8 bytes out, 8 in; 160 bits, 500 us, 1 ms.
    settings = {"return_delay": 5e-4, "latency": 1e-3}
    assert exchange_time(8, [8], baud=1_000_000, **settings) == pytest.approx(1.66e-3)
    assert exchange_time(8, [8], baud=57_600, **settings) == pytest.approx(160 / 57_600 + 1.5e-3)
    # A full block of 62 bytes does not wait for the latency timer.
    assert exchange_time(8, [62], baud=1_000_000, **settings) == pytest.approx(1.2e-3)


def test_reads_and_writes_of_eighteen_servos():
    ax, mx, xl = (model(name) for name in ("AX-12A", "MX-28", "XL430-W250"))
    settings = {"baud": 1_000_000, "return_delay": 0.0, "latency": 1e-3}
    assert read_time(ax, 18, 2, **settings) == pytest.approx(18 * 1.16e-3)
    # Bulk read of 7 + 3 * 18 bytes, 18 answers of 8.
    assert read_time(mx, 18, 2, **settings) == pytest.approx(10e-6 * (61 + 144) + 1e-3)
    # Sync read of 14 + 18 bytes, 18 answers of 15.
    assert read_time(xl, 18, 4, **settings) == pytest.approx(10e-6 * (32 + 270) + 1e-3)
    # Sync writes: 8 + 18 * 3 bytes, 14 + 18 * 5 bytes.
    assert write_time(ax, 18, 2, baud=1_000_000) == pytest.approx(620e-6)
    assert write_time(xl, 18, 4, baud=1_000_000) == pytest.approx(1040e-6)
    rate = achievable_rate(ax, 18, baud=1_000_000, read_servos=6)
    assert rate == pytest.approx(1 / (620e-6 + 6 * 1.16e-3))


@pytest.mark.parametrize("table", models().values(), ids=lambda table: table.name)
def test_registers_do_not_overlap_and_hold_their_values(table):
    end = 0
    for register in table.registers.values():
        assert register.address >= end
        end = register.end
        for value in (register.low, register.high, register.initial):
            assert register.from_bytes(register.to_bytes(value)) == value
        if register.writable:
            assert register.low < register.high
            assert set(register.limits) <= set(table.registers)
    assert end == table.size
    speed = table.register("present_speed")
    assert speed.from_bytes(speed.to_bytes(-5)) == -5


def test_units_and_baud_rates():
    ax, xl = model("AX-12A"), model("XL430-W250")
    goal = ax.register("goal_position")
    assert goal.from_si(goal.to_si(700)) == 700
    assert goal.to_si(512) == 0.0
    assert (ax.baud_value(1_000_000), ax.baud_value(57_600), xl.baud_value(57_600)) == (1, 34, 1)
    with pytest.raises(InvalidInput, match="has no baud rate of"):
        xl.baud_value(1_500_000)
    with pytest.raises(InvalidInput, match='servo called "AX-12"') as error:
        model("AX-12")
    assert error.value.hint == '"AX-12A"'
