"""Causes of falls: slopes, the centre of mass, and servos, judged from the last second."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from phasmid.experiment.ending import Ending, Failure
from phasmid.gait.support import support_margin
from phasmid.kinematics import centre_of_mass, quaternion_rotation
from phasmid.robot import JOINTS
from phasmid.simulation.channels import sample_channels
from phasmid.simulation.loop import Samples
from phasmid.simulation.termination import FASTEST_BODY
from phasmid.terrain.sliding import Slide, find_slide

if TYPE_CHECKING:
    from phasmid.simulation.run import Run

MEMORY, INTERVAL = 1.0, 0.01
"""Time before a fall from which its cause is judged, and between two states of it [s]. A robot tips
over within the former."""

OVERLOAD, OVERLOAD_TIME, OVERLOAD_SHARE = 0.95, 0.2, 0.8
"""Share of its largest torque from which a servo gives all it has, and for how long it must do so
to be the cause of a fall [s], or for what share of a shorter run; a foot that hits the ground loads
a servo for a shorter time."""

UPRIGHT = math.cos(math.radians(15))
"""Cosine between the normal of trunk and ground below which a robot is already tipping."""

EARLIER = 10
"""Number of last states in all of which a robot that slides is fast."""

STEEP = math.radians(5)
"""Steepness of ground that counts as a cause [rad]; legs give way by as much on level ground."""


class Past:
    """States of a run's last second.

    Args:
        run: The run; its drive and ground are used.
    """

    def __init__(self, run: Run) -> None:
        self._run, self._count = run, 0
        self._every = max(1, round(INTERVAL / run.dt))
        self._rows: deque[np.void] = deque(maxlen=round(MEMORY / (self._every * run.dt)))

    def add(self, samples: Samples) -> None:
        """Keep some of the next samples."""
        self._rows.extend(samples[-self._count % self._every :: self._every].copy())
        self._count += len(samples)

    def explain(self, failure: Failure) -> Failure:
        """Return a failure with its cause and a remedy, where these states show one."""
        fell = failure.ending is Ending.FELL
        if len(self._rows) < 2 or not (fell or failure.ending is Ending.DIVERGED):
            return failure
        samples = self._samples
        slid = self._slid(failure, samples)
        if slid or not fell:
            return slid or failure
        return self._tipped(failure, samples) or self._overloaded(failure, samples) or failure

    def slide(self) -> Slide | None:
        """Return how the robot slides down its ground, or None."""
        if len(self._rows) < 2:
            return None
        run, samples = self._run, self._samples
        time, channels = (
            np.arange(len(samples)) * (self._every * run.dt),
            sample_channels(run, samples),
        )
        feet, contact = channels["foot_position"], channels["contact"]
        return find_slide(run.ground, run.experiment.scale, time, feet, contact)

    @property
    def _samples(self) -> Samples:
        return np.array(list(self._rows), dtype=self._rows[0].dtype)

    def _slid(self, failure: Failure, samples: Samples) -> Failure | None:
        """Return a failure whose cause is that the robot slid."""
        run, slide = self._run, self.slide()
        if slide is None:
            return None
        who = f"{failure.reason} while the robot"
        if failure.ending is Ending.DIVERGED:
            # A simulation that diverges is not fast before.
            if np.linalg.norm(samples["qvel"][-EARLIER:, :3], axis=1).min() < FASTEST_BODY / 2:
                return None
            who = "it"
        return replace(
            failure,
            ending=Ending.FELL,
            reason=f"{who} slid at {slide.speed:.2g} m/s: {slide.cause}",
            remedy=slide.remedy(run.ground),
        )

    def _tipped(self, failure: Failure, samples: Samples) -> Failure | None:
        """Return a failure whose cause is that the centre of mass was beyond the feet."""
        run, legs = self._run, len(self._run.robot.legs)
        feet = sample_channels(run, samples)["foot_position"]
        normal = run.ground.normal(feet[..., 0], feet[..., 1]).mean(axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        R = quaternion_rotation(samples["qpos"][:, 3:7])
        upright = np.flatnonzero(np.sum(R[:, :, 2] * normal, axis=1) >= UPRIGHT)
        if not len(upright):
            return None
        last = int(upright[-1])
        slope = math.acos(min(float(normal[last, 2]), 1.0))
        com = centre_of_mass(run.robot, samples["qpos"][last, 7:].reshape(legs, 3))
        place = samples["qpos"][last, :3] + R[last] @ com
        every = np.ones(legs, dtype=bool)
        margin = float(support_margin(feet[last, :, :2], every, place[:2]))
        if margin >= 0 or slope < STEEP:
            return None
        cause = (
            f"on ground {math.degrees(slope):.3g}° steep its centre of mass was "
            f"{-1000 * margin:.0f} mm beyond its feet"
        )
        remedy = (
            "flatter ground, a lower body (--body-height-mm) or feet farther out "
            "(--stance-radius-mm)"
        )
        return replace(failure, reason=f"{failure.reason}: {cause}", remedy=remedy)

    def _overloaded(self, failure: Failure, samples: Samples) -> Failure | None:
        """Return a failure whose cause is an overloaded servo."""
        run = self._run
        full = run.drive.load(samples) >= OVERLOAD
        interval = self._every * run.dt
        time = full.sum(axis=0) * interval
        joint = int(np.argmax(time))
        if time[joint] < min(OVERLOAD_TIME, OVERLOAD_SHARE * len(full) * interval):
            return None
        name = f"{run.robot.leg_names[joint // 3]}.{JOINTS[joint % 3]}"
        cause = f"servo {name} was at its largest torque for {time[joint]:.2g} s"
        remedy = f"a stronger servo, or {failure.remedy}"
        return replace(failure, reason=f"{failure.reason}: {cause}", remedy=remedy)
