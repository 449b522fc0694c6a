"""Identification of servos from logs of a pendulum bench or of a leg in the air."""

from phasmid.identification.bam import BamParameters, load_bam, save_bam
from phasmid.identification.fit import identify
from phasmid.identification.log_file import load_bench_log
from phasmid.identification.logs import BenchLog, LegLog, Pendulum
from phasmid.identification.parameters import MODELS, Model
from phasmid.identification.result import Determined, Identification, TradeOff
from phasmid.identification.simulation import simulate_logs

__all__ = [
    "MODELS",
    "BamParameters",
    "BenchLog",
    "Determined",
    "Identification",
    "LegLog",
    "Model",
    "Pendulum",
    "TradeOff",
    "identify",
    "load_bam",
    "load_bench_log",
    "save_bam",
    "simulate_logs",
]
