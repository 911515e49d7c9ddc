"""PhysX: the world that bodies move in, settling, and the Vulkan driver that shows it."""
