"""Control in closed loop: observations and commands in, joint targets out."""

from phasmid.control.constraints import VelocityLimit
from phasmid.control.engine import LocomotionEngine
from phasmid.control.player import Player
from phasmid.control.safety import Mode, SafetyMonitor, SafetySettings
from phasmid.control.safety_filter import SafetyFilter
from phasmid.control.script import (
    CommandScript,
    commands_to_text,
    load_script,
    script_from_text,
)
from phasmid.control.sequences import Sequencer
from phasmid.control.settings import EngineSettings

__all__ = [
    "CommandScript",
    "EngineSettings",
    "SafetyMonitor",
    "VelocityLimit",
    "LocomotionEngine",
    "Mode",
    "Player",
    "load_script",
    "commands_to_text",
    "script_from_text",
    "SafetyFilter",
    "SafetySettings",
    "Sequencer",
]
