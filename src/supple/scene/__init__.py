"""What a user describes: bodies, obstacles, pins, loads, joints, stitches, actuators, sensors, and their scene."""
