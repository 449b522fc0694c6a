"""Identification of servos from logs of a bench."""

from phasmid.identification.bench import BenchLog, Pendulum, simulate_bench
from phasmid.identification.fit import Determined, Identification, TradeOff, identify
from phasmid.identification.parameters import MODELS, Model

__all__ = [
    "MODELS",
    "BenchLog",
    "Determined",
    "Identification",
    "Model",
    "Pendulum",
    "TradeOff",
    "identify",
    "simulate_bench",
]
