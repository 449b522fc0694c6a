"""Channels of any numbers, one of each kind."""

from contextlib import contextmanager

import numpy as np
import pytest

from phasmid.recording import CHANNELS

SIZES = {"leg": 6, "joint": 3, "axis": 3, "quaternion": 4, "way": 3}

ODD = [-0.0, 5e-324, np.nan, -np.inf, 1 + 2**-52]
"""Signed zero, the smallest number and what is no number: a file must give them back."""


def everything(samples):
    """Arrays of all channels, by name."""
    rng = np.random.default_rng(samples)
    arrays = {}
    for name, channel in CHANNELS.items():
        numbers = rng.standard_normal((samples, *(SIZES[dim] for dim in channel.dims[1:])))
        arrays[name] = numbers > 0 if channel.kind == "bool" else numbers
    return arrays


@contextmanager
def files_of_at_most(size):
    """No file of this process can grow beyond a size [bytes]."""
    resource, signal = pytest.importorskip("resource"), pytest.importorskip("signal")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
