"""Drive a controller of your own in closed loop: a tripod gait of sine waves."""

import numpy as np

import phasmid
from phasmid.experiment import JointTargets


class SineTripod:
    """Legs 1, 3, 5 lift while 2, 4, 6 push, in turns."""

    def reset(self, observation):
        self.stand = observation.joint_position
        self.phase = np.pi * (np.arange(6) % 2)
        # Coxae of right and left legs turn in opposite senses to push the body forward.
        self.side = np.where(np.arange(6) < 3, 1.0, -1.0)

    def update(self, observation, command):
        wave = 2 * np.pi * observation.time + self.phase
        ramp = min(1.0, observation.time)
        offset, speed = np.zeros((2, 6, 3))
        reach = 2.0 * command.velocity[0] * ramp
        offset[:, 0] = -self.side * reach * np.cos(wave)
        offset[:, 1] = 0.25 * ramp * np.maximum(np.sin(wave), 0.0)
        speed[:, 0] = 2 * np.pi * self.side * reach * np.sin(wave)
        return JointTargets(self.stand + offset, speed)


scenario = phasmid.load_scenario("paper").replace(duration=6, drive="ideal-servo")
run = phasmid.drive(scenario, SineTripod(), phasmid.experiment.Command(velocity=(0.05, 0.0, 0.0)))
x, y, _ = run.body_position.values[-1]
print(f"{run.attrs['ending']}: it reached ({1000 * x:.0f}, {1000 * y:.0f}) mm.")
