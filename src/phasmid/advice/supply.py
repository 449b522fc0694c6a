"""Supply of the servos: their current, and the battery, regulator, wire and fuse that follow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.advice.answer import OVER_FULL
from phasmid.advice.bounds import StaticLoads
from phasmid.errors import InvalidInput
from phasmid.servo import Servo

CELL, FULL_CELL, EMPTY_CELL = 3.7, 4.2, 3.3
"""Voltage of a lithium-polymer cell: nominal, full, and where it should be charged again [V]."""

CELL_RESISTANCE = 0.010
"""Internal resistance of a used cell of `CAPACITY` [Ω], assumed; it falls with the capacity. New
cells for models have 2 to 6 mΩ, worn ones 20 mΩ."""

CAPACITY, USABLE = 2.2, 0.8
"""Default capacity of the battery [A h], and its share that may be used: lithium cells suffer
below a fifth of their charge."""

COPPER = 0.020e-6
"""Resistance times cross-section of stranded copper over its length [Ω·m], IEC 60228 class 5."""

WIRES = {0.75e-6: 7.5, 1e-6: 9.5, 1.5e-6: 12.0, 2.5e-6: 16.0, 4e-6: 21.0, 6e-6: 27.0, 10e-6: 36.5}
"""Current that a wire carries continuously [A], by its cross-section [m²]: half of what DIN VDE
0298-4 allows a single one with PVC in free air, since wires of robots lie in bundles."""

LARGEST_DROP = 0.03
"""Share of the voltage that a wire may lose at the largest working current."""

FUSES = 2, 3, 4, 5, 7.5, 10, 15, 20, 25, 30, 35
"""Usual blade fuses [A], ISO 8820-3."""

FUSE_OPENS = 2.0
"""Current over a blade fuse's rating at which it opens within seconds, ISO 8820-3."""

REGULATORS = 3, 5, 8, 10, 15, 20, 25, 30
"""Usual current ratings of step-down regulators [A]."""

REGULATOR_LOSS, REGULATOR_EFFICIENCY = 0.5, 0.9
"""Voltage that a step-down regulator needs above its output [V], and its efficiency, assumed."""


@dataclass(frozen=True)
class Currents:
    """Current that all servos take from their supply [A].

    Pairs are bounds: without help from the floor, then with its best help. The loads are static:
    starts and impacts are not in them; `to_carry` has room for them.

    Attributes:
        mean: Mean of a cycle, with the electronics.
        walking: Largest of a cycle, with the electronics.
        rising: Largest while standing up, or in the stance, with the electronics.
        stall: Sum of the stall currents.
        leg_stall: Stall currents of one leg.
    """

    mean: tuple[float, float]
    walking: tuple[float, float]
    rising: tuple[float, float]
    stall: float
    leg_stall: float

    @property
    def largest(self) -> float:
        """Largest static current [A]."""
        return max(self.walking[0], self.rising[0])

    @property
    def to_carry(self) -> float:
        """What battery, fuse, wire and regulator must carry: one leg stalled beside it [A]."""
        return self.largest + self.leg_stall


def currents(loads: StaticLoads, servo: Servo, full: float) -> Currents | None:
    """Return the currents of a robot that walks and stands up.

    A servo takes the winding's loss and the motor's power, at most that at stall. The upper end of
    the mean counts the rms current of joints that move to and fro, of the largest that which drives
    against the load. The lower ends count joints at rest, whose gears help to hold.

    Args:
        loads: The static loads of the robot.
        servo: Its servo at the lowest voltage of its supply: there the loads take most.
        full: Highest voltage of the supply, for the stall currents [V].

    Returns:
        The currents; None without a known motor, and where the robot topples.
    """
    motor = servo.known_motor
    if motor is None or not loads.is_stable:
        return None
    strength, voltage, resistance = loads.robot.arrays.strength, servo.voltage, motor.resistance
    stall = strength * full / resistance
    torque, speed = loads.torque / strength, np.abs(loads.postures.qd)

    def drawn(
        current: Float[np.ndarray, "postures legs 3"], moving: float = 1.0
    ) -> Float[np.ndarray, " postures"]:
        power = current * (resistance * current + moving * motor.constant * speed)
        power = (strength * np.minimum(power, voltage**2 / resistance)).sum(axis=(1, 2))
        return np.asarray(power / voltage + stall.size * servo.standby_current)

    weight = loads.postures.weight
    walks = weight > 0
    most = drawn(motor.lifting_current(torque[0]))
    mean = drawn(motor.working_current(torque[0]))
    least = drawn(motor.holding_current(torque[1]), moving=0.0)
    return Currents(
        mean=(float(mean @ weight), float(least @ weight)),
        walking=(float(most[walks].max()), float(least[walks].max())),
        rising=(float(most[~walks].max()), float(least[~walks].max())),
        stall=float(stall.sum()),
        leg_stall=float(stall.sum(axis=1).max()),
    )


@dataclass(frozen=True)
class Wiring:
    """Battery and wire between it and the servos.

    Attributes:
        cells: Cells of a lithium-polymer battery in series; None: the supply keeps its voltage.
        capacity: Capacity of the battery [A h].
        wire_area: Cross-section of the wire to the servos [m²]; None: its drop does not count.
        wire_length: Its length, one way [m].

    Raises:
        InvalidInput: A number is out of range.
    """

    cells: int | None = None
    capacity: float = CAPACITY
    wire_area: float | None = None
    wire_length: float = 0.3

    def __post_init__(self) -> None:
        for name, value, least, most in (
            ("cells", self.cells, 1, 14),
            ("capacity", self.capacity, 0.01, 1000),
            ("wire_area", self.wire_area, 0.03e-6, 100e-6),
            ("wire_length", self.wire_length, 0, 20),
        ):
            if value is not None and not least <= value <= most:
                raise InvalidInput(f"{name} is {value:g}; it must be from {least:g} to {most:g}.")
        if self.cells is not None and self.cells % 1:
            raise InvalidInput(f"cells is {self.cells:g}; it must be a whole number.")

    def battery(self, servo: Servo) -> tuple[int, bool]:
        """Return the cells of a battery for a servo, and whether it does without a regulator."""
        voltage = min(servo.voltage, servo.maximum_voltage)
        cells = self.cells or math.ceil(voltage / FULL_CELL - 1e-9)
        direct = FULL_CELL * cells <= OVER_FULL * servo.maximum_voltage
        if self.cells is None and not direct:
            cells = math.ceil((voltage + REGULATOR_LOSS) / EMPTY_CELL)
        return cells, direct

    def voltages(self, servo: Servo) -> tuple[float, float]:
        """Return the lowest and highest voltage of that battery, or of its regulator [V]."""
        cells, direct = self.battery(servo)
        if direct:
            return EMPTY_CELL * cells, FULL_CELL * cells
        left = EMPTY_CELL * cells - REGULATOR_LOSS
        return (min(servo.voltage, servo.maximum_voltage, left),) * 2

    def resistance(self, servo: Servo) -> float:
        """Return the resistance between the source of a constant voltage and the servos [Ω]."""
        cells = (self.cells or 0) if self.battery(servo)[1] else 0
        wire = wire_resistance(self.wire_length, self.wire_area) if self.wire_area else 0.0
        return cells * CELL_RESISTANCE * CAPACITY / self.capacity + wire


def currents_and_voltage(loads: StaticLoads, wiring: Wiring) -> tuple[Currents | None, float]:
    """Return the currents of a robot on a nearly empty battery, and the voltage at its servos [V].

    The voltage is rounded down to 10 mV. It falls with the current, and the current rises as it
    falls. Where no cells are given, the battery and wire lose it from the servos' own supply.

    Raises:
        InvalidInput: Less than half of the voltage would be left.
    """
    servo = loads.robot.servo
    low, high = wiring.voltages(servo)
    resistance, lost, before = wiring.resistance(servo), 0.0, math.nan
    while lost != before:
        needed = currents(loads, servo.at(low - lost), high)
        current = needed.largest if needed else 0.0
        lost, before = math.ceil(100 * current * resistance) / 100, lost
        if lost >= low / 2:
            raise InvalidInput(
                f"battery and wire would lose more than half of {low:.3g} V at {current:.1f} A; no "
                "servo works on the rest.",
                hint="a larger --wire-mm2 or a shorter --wire-length-mm",
            )
    return needed, round((low if wiring.cells else servo.voltage) - lost, 9)


def wire_resistance(length: float, area: float) -> float:
    """Return the resistance there and back [Ω] of a wire, of its length [m] and area [m²]."""
    return 2 * length * COPPER / area


@dataclass(frozen=True)
class Supply:
    """What to buy for the currents of a robot.

    Attributes:
        cells: Lithium-polymer cells in series.
        c_rating: Least C rating of the battery: it opens the fuse.
        fuse: Fuse at the battery [A].
        leg_fuse: Fuse of the lead to one leg [A].
        leg_area: Least usual cross-section of that lead [m²].
        regulator: Output of the step-down regulator (BEC) between battery and servos [V]; None:
            the servos are connected to the battery.
        regulator_current: Its current rating [A]; 0 without one.
        wire_area: Least usual cross-section of the wire to the servos [m²].
        wire_drop: Voltage that it loses at the largest static current [V].
        minutes: Time of walking on `USABLE` of the battery, least and most [min].
    """

    cells: int
    c_rating: int
    fuse: float
    leg_fuse: float
    leg_area: float
    regulator: float | None
    regulator_current: float
    wire_area: float
    wire_drop: float
    minutes: tuple[float, float]


def supply(servo: Servo, needed: Currents, wiring: Wiring) -> Supply | None:
    """Return battery, regulator, wire and fuses; None where the current is too large for one wire.

    Args:
        servo: The servo as supplied.
        needed: The currents.
        wiring: Battery and wire; cells are chosen where it has none.
    """
    cells, direct = wiring.battery(servo)
    voltage, length = wiring.voltages(servo)[0], wiring.wire_length
    # The battery of a regulator gives its power at another voltage.
    ratio = voltage / (CELL * cells * REGULATOR_EFFICIENCY)
    ratio, most = (1.0, 1.0) if direct else (ratio, ratio * CELL / EMPTY_CELL)
    fuse = _usual(FUSES, most * needed.to_carry)
    regulator = 0.0 if direct else _usual(REGULATORS, needed.to_carry)
    leg_fuse = _usual(FUSES, needed.leg_stall)
    carried = fuse if direct else regulator
    if fuse is None or leg_fuse is None or carried is None:
        return None
    drops = {area: needed.largest * wire_resistance(length, area) for area in WIRES}
    fit = (a for a in WIRES if WIRES[a] >= carried and drops[a] <= LARGEST_DROP * voltage)
    area = next(fit, None)
    if area is None:
        return None
    charge = 60 * USABLE * wiring.capacity / ratio
    return Supply(
        cells=cells,
        c_rating=math.ceil(FUSE_OPENS * fuse / wiring.capacity),
        fuse=fuse,
        leg_fuse=leg_fuse,
        leg_area=next(area for area in WIRES if WIRES[area] >= leg_fuse),
        regulator=None if direct else voltage,
        regulator_current=regulator or 0.0,
        wire_area=area,
        wire_drop=drops[area],
        minutes=(charge / needed.mean[0], charge / needed.mean[1]),
    )


def _usual(ratings: tuple[float, ...], current: float) -> float | None:
    """Return the least usual rating for a current [A]; None where all are too small."""
    return next((rating for rating in ratings if rating >= current), None)
