"""What torques the commanded motion takes, and whether ground and servos can give them.

Its modules of loops load the compiler when they are imported; they are imported by who uses them.
"""
