"""The closed loop in SAPIEN: gripper, arm, cameras, suction, and the emptying of a clutter."""
