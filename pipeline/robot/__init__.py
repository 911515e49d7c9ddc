"""A real arm, its cameras and its vacuum as the policy's `Eyes` and `Robot`."""
