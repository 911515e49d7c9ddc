"""Which installed packages decide a stage's result, and in what versions."""

import sys
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version

from pipeline.execution.code import DRAWING, RUNNING, foreign_imports

# They tell, annotate or distribute: with another version of them a result is the same.
WITHOUT_EFFECT = frozenset({"loguru", "jaxtyping", "typer", "tqdm", "filelock", "ray"})
# What a package calls that our code does not name.
CALLED_BY = {
    "numba": ("llvmlite",),
    "qpsolvers": ("clarabel", "piqp"),
    "trimesh": ("networkx", "rtree"),
}
ABSENT = "not installed"


def package_versions(module: str, without: tuple[str, ...] = DRAWING + RUNNING) -> dict[str, str]:
    """Versions of the packages that a module reaches by import, through ours, and that decide.

    Parameters
    ----------
    module
        Dotted name, such as ``stages.grasps``.
    without
        Modules and packages of ours that are not followed, dotted.

    Returns
    -------
    Distribution → version; `ABSENT` where it is not there, as an optional one.
    """
    names = {name.split(".")[0] for name in foreign_imports(module, without)}
    names -= sys.stdlib_module_names | WITHOUT_EFFECT
    names |= {called for name in names for called in CALLED_BY.get(name, ())}
    return dict(sorted({dist: _version(dist) for name in names for dist in _named(name)}.items()))


def _named(import_name: str) -> list[str]:
    """The distributions that a top-level name is imported from."""
    try:
        version(import_name)
    except PackageNotFoundError:
        return sorted(set(_distributions().get(import_name, [import_name])))
    return [import_name]


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return ABSENT


@lru_cache(maxsize=1)
def _distributions() -> dict[str, list[str]]:
    return dict(packages_distributions())
