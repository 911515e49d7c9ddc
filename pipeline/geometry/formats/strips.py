"""Triangle strips and fans, which PLY and glTF have, as triangles."""

import numpy as np
from jaxtyping import Int


def strip_triangles(corners: Int[np.ndarray, " k"]) -> Int[np.ndarray, "m 3"]:
    """Each corner with the two before it, every second triangle turned; empty ones left out."""
    if len(corners) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return _filled(triangles)


def fan_triangles(corners: Int[np.ndarray, " k"]) -> Int[np.ndarray, "m 3"]:
    """Each pair of neighbours with the first corner; empty triangles left out."""
    if len(corners) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    first = np.full(len(corners) - 2, corners[0])
    return _filled(np.stack([first, corners[1:-1], corners[2:]], axis=1))


def _filled(triangles: Int[np.ndarray, "m 3"]) -> Int[np.ndarray, "k 3"]:
    a, b, c = triangles.T
    return np.asarray(triangles[(a != b) & (b != c) & (c != a)])
