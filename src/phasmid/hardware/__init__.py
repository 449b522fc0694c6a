"""Real servos: the bus, control tables, calibration, and an emulator; needs the extra `hardware`.

The emulator itself needs no extra. The names load when they are first used: the process that
switches the torque off loads the bus alone.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from phasmid.hardware.bus import Bus as Bus
    from phasmid.hardware.bus import BusError as BusError
    from phasmid.hardware.bus import ServoReading as ServoReading
    from phasmid.hardware.bus import Traffic as Traffic
    from phasmid.hardware.bus import usb_latency as usb_latency
    from phasmid.hardware.calibration import ServoCalibration as ServoCalibration
    from phasmid.hardware.calibration import default_calibration as default_calibration
    from phasmid.hardware.calibration import load_calibration as load_calibration
    from phasmid.hardware.calibration import save_calibration as save_calibration
    from phasmid.hardware.control_table import Model as Model
    from phasmid.hardware.control_table import Register as Register
    from phasmid.hardware.control_table import model as model
    from phasmid.hardware.control_table import models as models
    from phasmid.hardware.driver import Driver as Driver
    from phasmid.hardware.emulator import Emulator as Emulator
    from phasmid.hardware.emulator import make_servos as make_servos
    from phasmid.hardware.inspection import Inspection as Inspection
    from phasmid.hardware.inspection import inspect_servos as inspect_servos
    from phasmid.hardware.plant import Bench as Bench
    from phasmid.hardware.plant import Plant as Plant
    from phasmid.hardware.plant import SimulatedRobot as SimulatedRobot
    from phasmid.hardware.protection import DriverSettings as DriverSettings
    from phasmid.hardware.protection import Reaction as Reaction
    from phasmid.hardware.rates import achievable_rate as achievable_rate
    from phasmid.hardware.rates import exchange_time as exchange_time
    from phasmid.hardware.rates import read_time as read_time
    from phasmid.hardware.rates import write_time as write_time
    from phasmid.hardware.robot_bus import RobotBus as RobotBus
    from phasmid.hardware.stages import DriveReport as DriveReport
    from phasmid.hardware.status import StatusError as StatusError

_NAMES = {
    "bus": "Bus BusError ServoReading Traffic usb_latency",
    "calibration": "ServoCalibration default_calibration load_calibration save_calibration",
    "control_table": "Model Register model models",
    "driver": "Driver",
    "emulator": "Emulator make_servos",
    "inspection": "Inspection inspect_servos",
    "plant": "Bench Plant SimulatedRobot",
    "protection": "DriverSettings Reaction",
    "rates": "achievable_rate exchange_time read_time write_time",
    "robot_bus": "RobotBus",
    "stages": "DriveReport",
    "status": "StatusError",
}
"""Public names by the module that has them."""

_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names.split()}
__all__ = list(_MODULE_OF)


def __getattr__(name: str) -> Any:
    if name in _MODULE_OF:
        return getattr(import_module(f"phasmid.hardware.{_MODULE_OF[name]}"), name)
    raise AttributeError(f"module 'phasmid.hardware' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(_MODULE_OF)
