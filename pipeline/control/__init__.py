"""The closed-loop policy; knows no simulator, so the same code would drive the robot."""
