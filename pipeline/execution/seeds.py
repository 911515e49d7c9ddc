"""Every random stream of a run comes from its seed and a name, never from order or time."""

import hashlib

import numpy as np


def derive_seed(seed: int, *names: str | int) -> int:
    """A 63-bit seed for one work item, independent of every other item's."""
    text = "/".join([str(seed), *(str(name) for name in names)])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def generator(seed: int, *names: str | int) -> np.random.Generator:
    """The generator of one work item: ``generator(seed, "scene", scene_id)``."""
    return np.random.Generator(np.random.PCG64(derive_seed(seed, *names)))
