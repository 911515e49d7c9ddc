"""The SAPIEN world: Vulkan driver, table, bodies, their shading and lights."""
