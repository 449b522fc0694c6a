"""What is measured of the robot, as its sensors tell it: rate, delay, noise."""
