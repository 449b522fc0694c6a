"""Channels of any numbers, one of each kind."""

import numpy as np

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
