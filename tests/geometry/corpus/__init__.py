"""Mesh files of every kind that people bring, made by a script, each with what is right for it."""

from collections.abc import Iterator
from functools import cache

from tests.geometry.corpus import (
    body_cases,
    gltf_cases,
    obj_cases,
    off_cases,
    ply_cases,
    polygon_cases,
    stl_cases,
    urdf_cases,
)
from tests.geometry.corpus.case import Case
from tests.geometry.corpus.folder_cases import FolderCase, folder_cases

KINDS = {
    "polygons": polygon_cases,
    "OBJ": obj_cases,
    "STL": stl_cases,
    "OFF": off_cases,
    "PLY": ply_cases,
    "glTF": gltf_cases,
    "URDF": urdf_cases,
    "bodies": body_cases,
}


@cache
def corpus() -> dict[str, list[Case]]:
    """Every case, by kind; the names are unique."""
    cases = {kind: list(module.cases()) for kind, module in KINDS.items()}
    names = [case.name for held in cases.values() for case in held]
    assert len(names) == len(set(names)), sorted(n for n in names if names.count(n) > 1)
    return cases


@cache
def folders() -> list[FolderCase]:
    """Every folder of several files."""
    return list(folder_cases())


def corpus_cases() -> Iterator[Case]:
    """Every case."""
    for cases in corpus().values():
        yield from cases
