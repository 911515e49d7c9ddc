"""Meshes, NSVR, convex parts, ray scenes and SE(3)."""
