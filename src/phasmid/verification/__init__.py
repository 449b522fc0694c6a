"""The physics against closed forms: rows that a user can run."""

from phasmid.verification.row import Check, Row, Verdict
from phasmid.verification.table import CHECKS, verify

__all__ = ["CHECKS", "Check", "Row", "Verdict", "verify"]
