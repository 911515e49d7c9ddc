"""The one way functions of this package are compiled to machine code."""

from pipeline.compiled_code import Function, njit


def compiled(function: Function) -> Function:
    """Compile with IEEE arithmetic: NaN and -inf heights keep their meaning."""
    return njit(error_model="numpy")(function)


def compiled_finite(function: Function) -> Function:
    """Compile for finite arguments; sums may be regrouped so that they run in SIMD lanes.

    Always inlined: a callee compiled on its own regroups otherwise than inside its caller, and
    which of both runs would depend on whether the disk cache was warm. So would the last bits.
    """
    flags = {"reassoc", "contract", "nsz", "nnan"}
    return njit(error_model="numpy", fastmath=flags, forceinline=True)(function)
