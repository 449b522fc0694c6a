"""Real servos: the bus, control tables, calibration, and an emulator; needs the extra `hardware`.

The emulator itself needs no extra.
"""

from phasmid.hardware.bus import Bus, BusError, ServoReading, Traffic, usb_latency
from phasmid.hardware.calibration import (
    ServoCalibration,
    default_calibration,
    load_calibration,
    save_calibration,
)
from phasmid.hardware.control_table import Model, Register, model, models
from phasmid.hardware.driver import Driver, DriveReport
from phasmid.hardware.emulator import Emulator, make_servos
from phasmid.hardware.inspection import Inspection, inspect_servos
from phasmid.hardware.plant import Bench, Plant, SimulatedRobot
from phasmid.hardware.protection import DriverSettings, Reaction
from phasmid.hardware.rates import achievable_rate, exchange_time, read_time, write_time
from phasmid.hardware.robot_bus import RobotBus
from phasmid.hardware.status import StatusError

__all__ = [
    "Bench",
    "Bus",
    "BusError",
    "DriveReport",
    "Driver",
    "DriverSettings",
    "Emulator",
    "Inspection",
    "Model",
    "Plant",
    "Reaction",
    "Register",
    "RobotBus",
    "ServoCalibration",
    "ServoReading",
    "SimulatedRobot",
    "StatusError",
    "Traffic",
    "achievable_rate",
    "default_calibration",
    "inspect_servos",
    "exchange_time",
    "load_calibration",
    "make_servos",
    "model",
    "models",
    "read_time",
    "save_calibration",
    "usb_latency",
    "write_time",
]
