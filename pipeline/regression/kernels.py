"""Instruction sets by which one processor stands in for others, as environment variables.

PyTorch takes ``ATEN_CPU_CAPABILITY``, its convolutions (oneDNN) ``ONEDNN_MAX_CPU_ISA``, and code
that numba compiles ``NUMBA_CPU_NAME``, which `pipeline` pins unless it is set; each reads its
variable when it is imported. What a variable asks for and the processor lacks is not taken.
"""

INSTRUCTION_SETS: dict[str, dict[str, str]] = {
    "default": {
        "ATEN_CPU_CAPABILITY": "default",
        "ONEDNN_MAX_CPU_ISA": "SSE41",
        "NUMBA_CPU_NAME": "generic",
    },
    "avx2": {"ATEN_CPU_CAPABILITY": "avx2", "ONEDNN_MAX_CPU_ISA": "AVX2"},
    "avx512": {"ATEN_CPU_CAPABILITY": "avx512", "ONEDNN_MAX_CPU_ISA": "DEFAULT"},
}
"""Name → environment."""
