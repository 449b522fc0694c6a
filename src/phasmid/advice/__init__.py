"""Advice for builders: load, heat, battery time and choice of a robot's servos."""

from phasmid.advice.advice import Advice, ServoChoice, advise
from phasmid.advice.load import ServoLoad, simulate_load

__all__ = ["Advice", "ServoChoice", "ServoLoad", "advise", "simulate_load"]
