"""Algorithm 1 of the supplement: where grasps are tried, and their labels."""
