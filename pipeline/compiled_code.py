"""Functions compiled by numba, whose machine code on disk follows every source that it rests on.

By itself numba compiles anew when the function's own file has changed. But machine code also holds
what the function calls in other modules, and the values of constants that it takes from them. With
numba's own rule a changed tolerance in one file leaves the code of another as it was, and nobody is
told.
"""

import hashlib
from collections.abc import Callable, Collection, Iterator
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, Literal, TypeVar, cast

import numba
import numpy as np
from numba.core import caching

Function = TypeVar("Function", bound=Callable[..., Any])

# Makes an index unsigned in compiled loops: numba otherwise tests each for Python's negative ones,
# which made walks over many triangles a third slower.
unsigned = np.uint64

_OURS = Path(__file__).parent
_PLACES = ("UserProvidedCacheLocator", "InTreeCacheLocator", "UserWideCacheLocator")
_OF_NOTEBOOKS = ("IPythonCacheLocator", "ZipCacheLocator")  # and of archives: no file of ours
_VALUES = (bool, int, float, str, tuple, np.generic)  # whose repr tells them apart


def njit(
    error_model: Literal["python", "numpy"] = "python",
    fastmath: Collection[str] = (),
    nogil: bool = False,
    forceinline: bool = False,
) -> Callable[[Function], Function]:
    """Compile a function at its first call, and keep the machine code on disk.

    Parameters
    ----------
    error_model
        Whether a division by zero raises, or gives inf or NaN as NumPy does.
    fastmath
        Liberties that the compiler has with floating-point numbers, by LLVM's names.
    nogil
        Whether other threads run meanwhile.
    forceinline
        Whether it is written out wherever a compiled function calls it.

    Returns
    -------
    The decorator.
    """
    compile_it = numba.njit(
        cache=True,
        error_model=error_model,
        fastmath=set(fastmath) or False,
        nogil=nogil,
        forceinline=forceinline,
    )
    return cast(Callable[[Function], Function], compile_it)


class LocatorByAllSources(caching._CacheLocator):  # type: ignore[misc]
    """Tells numba where machine code of a function of ours lies, and what it rests on.

    Parameters
    ----------
    place
        Numba's own locator.
    function
        What is compiled.
    """

    def __init__(self, place: Any, function: FunctionType) -> None:
        self._place, self._function = place, function

    @classmethod
    def from_function(cls, py_func: FunctionType, py_file: str) -> "LocatorByAllSources | None":
        """The locator of a function below pipeline/; None of another: numba takes its own."""
        if not Path(py_file).is_relative_to(_OURS):
            return None
        for kind in _PLACES:
            if (place := getattr(caching, kind).from_function(py_func, py_file)) is not None:
                return cls(place, py_func)
        return None

    def ensure_cache_path(self) -> None:
        """Make the folder, and see that files can be written there."""
        self._place.ensure_cache_path()

    def get_cache_path(self) -> str:
        """Folder of the machine code."""
        return str(self._place.get_cache_path())

    def get_disambiguator(self) -> Any:
        """What tells functions of one name in one file apart."""
        return self._place.get_disambiguator()

    def get_source_stamp(self) -> Any:
        """Differs once the function's file has changed, or anything that it takes from others."""
        return self._place.get_source_stamp(), taken_from_elsewhere(self._function)


def taken_from_elsewhere(function: FunctionType) -> tuple[tuple[str, Any], ...]:
    """What machine code of a function may hold that is not written in the function's own file.

    Parameters
    ----------
    function
        What is compiled. Only names that its module has by now are seen; imports stand first.

    Returns
    -------
    Sorted by name: the value of each constant that the module has, and of each compiled function of
    another module the digest of that module's file and what it takes from elsewhere itself.
    """
    return tuple(sorted(_taken(function), key=lambda found: found[0]))


def _taken(function: FunctionType) -> Iterator[tuple[str, Any]]:
    for name, value in function.__globals__.items():
        if name.startswith("__"):  # Python's own
            continue
        if isinstance(value, numba.core.dispatcher.Dispatcher):
            called = value.py_func
            if called.__module__ != function.__module__:
                yield name, (_digest(called.__code__.co_filename), taken_from_elsewhere(called))
        elif isinstance(value, np.ndarray):
            yield name, (value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest())
        elif isinstance(value, _VALUES):
            yield name, repr(value)


@cache
def _digest(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


# A choice made outside stands.
if not numba.config.CACHE_LOCATOR_CLASSES:
    _ours = f"{__name__}.{LocatorByAllSources.__qualname__}"
    numba.config.CACHE_LOCATOR_CLASSES = ",".join((_ours, *_PLACES, *_OF_NOTEBOOKS))
