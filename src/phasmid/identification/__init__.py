"""Servos identified from logs of a bench or a leg in the air; a robot's log beside its replay."""

from phasmid.identification.bam import BamParameters, load_bam, save_bam
from phasmid.identification.comparison import Comparison, Quantity, compare
from phasmid.identification.fit import identify
from phasmid.identification.log_file import load_bench_log
from phasmid.identification.logs import BenchLog, LegLog, Pendulum
from phasmid.identification.parameters import MODELS, Model
from phasmid.identification.result import Determined, Identification, TradeOff
from phasmid.identification.robot_log import RobotLog
from phasmid.identification.simulation import simulate_logs

__all__ = [
    "MODELS",
    "BamParameters",
    "BenchLog",
    "Comparison",
    "Determined",
    "Identification",
    "LegLog",
    "Model",
    "Pendulum",
    "Quantity",
    "RobotLog",
    "TradeOff",
    "compare",
    "identify",
    "load_bam",
    "load_bench_log",
    "save_bam",
    "simulate_logs",
]
