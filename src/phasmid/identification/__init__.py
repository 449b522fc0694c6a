"""Identification of servos from logs of a bench."""

from phasmid.identification.bam import BamParameters, load_bam, save_bam
from phasmid.identification.bench import BenchLog, Pendulum, simulate_bench
from phasmid.identification.fit import Determined, Identification, TradeOff, identify
from phasmid.identification.log_file import load_bench_log
from phasmid.identification.parameters import MODELS, Model

__all__ = [
    "MODELS",
    "BamParameters",
    "BenchLog",
    "Determined",
    "Identification",
    "Model",
    "Pendulum",
    "TradeOff",
    "identify",
    "load_bam",
    "load_bench_log",
    "save_bam",
    "simulate_bench",
]
