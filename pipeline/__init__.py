"""The library of softgrip, which the commands in `stages` call; it imports nothing from them."""

import importlib
import os
from pathlib import Path

_CPU = Path("/proc/cpuinfo")

# The arithmetic of one kind of processor on every one that has AVX2. Where there is AVX-512 these
# libraries take other kernels by themselves, and a last bit that differs settles a clutter
# elsewhere: OpenBLAS sums products in another order, NumPy's exp and log end on other bits, and
# numba compiles other instructions (they would save 6 % of the time of a label, measured). Each
# reads its variable when it is imported; a choice made outside stands, and workers inherit these.
_ONE_KIND = {
    "OPENBLAS_CORETYPE": {"OPENBLAS_CORETYPE": "Haswell"},
    "NPY_DISABLE_CPU_FEATURES": {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"},
    "NUMBA_CPU_NAME": {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ""},
}
# One thread a process: there is a process for each core, and products here are so small that two
# threads wait for each other longer than they compute (16 ms instead of 0.3 for 60 000 points in
# another frame, on two busy cores).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

if _CPU.is_file() and "avx2" in _CPU.read_text():
    for _chosen_by, _settings in _ONE_KIND.items():
        if _chosen_by not in os.environ:
            os.environ.update(_settings)

# The tests name a module here that checks every array against its annotation.
if "SOFTGRIP_IMPORT_FIRST" in os.environ:
    importlib.import_module(os.environ["SOFTGRIP_IMPORT_FIRST"])
