"""The engine's loops are compiled once, by one of the processes that test.

As a program it compiles the engine, the second simulator and the environments of learning, while
pip installs other packages.
"""

import os
from contextlib import contextmanager

import numpy as np

import phasmid
from phasmid.experiment import Command, Observation

try:
    import fcntl
except ModuleNotFoundError:
    # Windows: each process compiles.
    fcntl = None


@contextmanager
def one_at_a_time(path):
    """Wait until no other process is inside; the system unlocks a process that ends."""
    with path.open("w") as file:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def walk_once():
    """Let every stage of an engine compute once."""
    robot = phasmid.load_robot("phantomx-ax")
    engine = phasmid.LocomotionEngine(robot, ground_sensing=True, dynamics="feed-forward")
    legs = len(robot.legs)
    observation = Observation(
        0.0,
        engine.state.q.copy(),
        contact=np.ones(legs, dtype=bool),
        joint_load=np.zeros((legs, 3)),
        orientation=np.array([1.0, 0.0, 0.0, 0.0]),
        angular_velocity=np.zeros(3),
        acceleration=np.array([0.0, 0.0, 9.81]),
    )
    engine.reset(observation)
    engine.update(observation, Command(velocity=(0.02, 0.0, 0.0)))


def compile_once(folder):
    """With several processes and nothing compiled yet, one compiles and the others wait for it.

    Args:
        folder: That the processes of one run share.
    """
    from phasmid.control.compilation import are_compiled

    if "PYTEST_XDIST_WORKER" not in os.environ or are_compiled():
        return
    with one_at_a_time(folder / "compiling.lock"):
        if not are_compiled():
            walk_once()


def simulate_once():
    """Let the simulator of the paper's contact law compute once."""
    paper = phasmid.load_scenario("paper").replace(duration=0.01, contact_law="simscape")
    phasmid.simulate(paper, phasmid.plan(paper))


def learn_once():
    """Let robots of both fidelities and of all tasks step once."""
    from phasmid.learning import WalkVectorEnv

    for fidelity, task in (("fast", "walk"), ("full", "walk"), ("fast", "damaged")):
        env = WalkVectorEnv(1, task=task, fidelity=fidelity)
        env.reset(seed=0)
        env.step(np.zeros((1, 18)))


if __name__ == "__main__":
    walk_once()
    simulate_once()
    # Last, since pip brings Gymnasium with the developer's packages.
    learn_once()
