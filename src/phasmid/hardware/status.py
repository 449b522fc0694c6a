"""Status errors of servos as named flags, for both protocols."""

from __future__ import annotations

from enum import IntFlag, auto


class StatusError(IntFlag):
    """Errors that a servo reports.

    The first seven have the bits of protocol 1.0's error byte. Protocol 2.0 reports one of the
    numbered errors of an instruction, and by `ALERT` a hardware error; the register
    ``hardware_error_status`` says which.
    """

    VOLTAGE = auto()
    ANGLE_LIMIT = auto()
    OVERHEATING = auto()
    RANGE = auto()
    CHECKSUM = auto()
    OVERLOAD = auto()
    INSTRUCTION = auto()
    RESULT = auto()
    LENGTH = auto()
    LIMIT = auto()
    ACCESS = auto()
    ENCODER = auto()
    SHOCK = auto()
    ALERT = auto()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the flags that are set, in lower case."""
        return tuple(str(flag.name).lower().replace("_", " ") for flag in self)


NONE = StatusError(0)

NUMBERED = (
    NONE,
    StatusError.RESULT,
    StatusError.INSTRUCTION,
    StatusError.CHECKSUM,
    StatusError.RANGE,
    StatusError.LENGTH,
    StatusError.LIMIT,
    StatusError.ACCESS,
)
"""Errors of an instruction by their number in protocol 2.0."""

HARDWARE = {
    0: StatusError.VOLTAGE,
    2: StatusError.OVERHEATING,
    3: StatusError.ENCODER,
    4: StatusError.SHOCK,
    5: StatusError.OVERLOAD,
}
"""Hardware errors by their bit in ``hardware_error_status`` and ``shutdown`` of protocol 2.0."""

ALERT = 0x80


def status_error(protocol: int, byte: int) -> StatusError:
    """Return the flags of the error byte of a status packet."""
    if protocol == 1:
        return StatusError(byte & 0x7F)
    number = byte & ~ALERT
    error = NUMBERED[number] if number < len(NUMBERED) else StatusError.RESULT
    return error | StatusError.ALERT if byte & ALERT else error


def error_byte(protocol: int, error: StatusError) -> int:
    """Return the error byte of a status packet; of several errors 2.0 reports the first one."""
    if protocol == 1:
        return int(error) & 0x7F
    number = next((n for n, flag in enumerate(NUMBERED) if flag & error), 0)
    return number | (ALERT if error & StatusError.ALERT else 0)


def hardware_error(byte: int) -> StatusError:
    """Return the flags of the register ``hardware_error_status``."""
    error = NONE
    for bit, flag in HARDWARE.items():
        if byte >> bit & 1:
            error |= flag
    return error


def hardware_byte(error: StatusError) -> int:
    """Return the value of the register ``hardware_error_status``."""
    return sum(1 << bit for bit, flag in HARDWARE.items() if flag & error)


def shutdown_errors(protocol: int, byte: int) -> StatusError:
    """Return the errors on which a servo shuts down, from its register ``shutdown``."""
    return StatusError(byte & 0x7F) if protocol == 1 else hardware_error(byte)
