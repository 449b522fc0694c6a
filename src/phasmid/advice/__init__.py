"""Advice for builders: do the servos hold, how long, with which supply, and which others do."""

from phasmid.advice.adviser import Advice, ServoChoice, advise
from phasmid.advice.answer import Grade, Holding, ServoVerdict
from phasmid.advice.supply import Currents, Supply, Wiring
from phasmid.advice.verdict import servo_verdict

__all__ = [
    "Advice",
    "Currents",
    "Grade",
    "Holding",
    "ServoChoice",
    "ServoVerdict",
    "Supply",
    "Wiring",
    "advise",
    "servo_verdict",
]
