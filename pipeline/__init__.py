"""What the stages of softgrip are made of; imports nothing from ``stages``."""

import importlib
import os
from pathlib import Path

_CPU = Path("/proc/cpuinfo")

# Matrix products in one order of summation, whatever the processor: OpenBLAS takes other kernels
# where there is AVX-512, and a last bit that differs settles a clutter elsewhere. It reads this
# when NumPy is imported; a choice made outside stands, and workers inherit this one.
if "OPENBLAS_CORETYPE" not in os.environ and _CPU.is_file() and "avx2" in _CPU.read_text():
    os.environ["OPENBLAS_CORETYPE"] = "Haswell"

# The tests name a module here that checks every array against its annotation.
if "SOFTGRIP_IMPORT_FIRST" in os.environ:
    importlib.import_module(os.environ["SOFTGRIP_IMPORT_FIRST"])
