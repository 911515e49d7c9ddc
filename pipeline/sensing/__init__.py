"""Cameras, depth rendering, depth noise and organised sub point clouds."""
