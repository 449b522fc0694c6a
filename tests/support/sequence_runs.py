"""Runs of sequences without physics: joints that are where their targets were."""

from dataclasses import dataclass, replace

import numpy as np

from phasmid.experiment import JointTargets, Observation

DT = 0.005


class Still:
    """A controller that holds the joints as they were when it was reset."""

    def __init__(self):
        self.commands = []
        self.q = np.zeros((0, 3))

    def reset(self, observation):
        self.q = np.array(observation.joint_position)

    def update(self, observation, command):
        self.commands.append(command)
        return JointTargets(self.q, 0 * self.q)


@dataclass
class Told:
    """What the joints were told, update by update."""

    q: np.ndarray
    qd: np.ndarray
    stages: list[int]


def run(
    sequencer, q, commands, *, change=lambda _, observation: observation, begin=True, until=None
):
    """Update a sequencer with one command after the other, every 5 ms.

    Args:
        sequencer: What is run.
        q: Joint angles at the start [rad].
        commands: One for each update.
        change: Changes what is observed at an update.
        begin: Whether it is reset before.
        until: Twenty updates after this stage is reached no more is done.
    """
    start = 0.0 if begin else sequencer._time
    observation = Observation(start, q)
    if begin:
        sequencer.reset(change(-1, observation))
    told = []
    stages = []
    for k, command in enumerate(commands):
        seen = replace(observation, time=start + (k + 1) * DT)
        targets = sequencer.update(change(k, seen), command)
        told.append(targets)
        stages.append(sequencer.stage.value)
        observation = replace(observation, joint_position=targets.position)
        if until is not None and stages[-20:] == [until.value] * 20:
            break
    return Told(np.array([t.position for t in told]), np.array([t.velocity for t in told]), stages)
