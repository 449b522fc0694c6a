"""The live page: the robot in physics, driven and looked into from a browser."""
