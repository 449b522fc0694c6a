"""Recordings: named channels with units, and their files."""

from phasmid.recording.channels import AXES, CHANNELS, JOINTS, QUATERNION, Channel
from phasmid.recording.file import load_recording, save_recording
from phasmid.recording.log import DamagedRecording, RecordingLog, check_log
from phasmid.recording.recording import FORMAT, Recording, check_time, new_recording
from phasmid.recording.ros import save_mcap
from phasmid.recording.table import save_csv

__all__ = [
    "AXES",
    "CHANNELS",
    "FORMAT",
    "JOINTS",
    "QUATERNION",
    "Channel",
    "DamagedRecording",
    "Recording",
    "RecordingLog",
    "check_log",
    "check_time",
    "load_recording",
    "new_recording",
    "save_csv",
    "save_mcap",
    "save_recording",
]
