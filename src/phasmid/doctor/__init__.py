"""What this machine can do, and what to install for the rest."""

from phasmid.doctor.examination import examine
from phasmid.doctor.finding import Finding, State

__all__ = ["Finding", "State", "examine"]
