"""The page of the corpus: what each file is, and what reading it gives."""

from pathlib import Path

from pipeline.errors import MeshError
from pipeline.geometry.shape import outer_surface, surface_area, volume
from tests.geometry.corpus import corpus, folders
from tests.geometry.corpus.case import Case
from tests.geometry.corpus.folder_cases import FolderCase
from tests.geometry.corpus.reading import objects_of, read

PAGE = Path(__file__).with_name("README.md")
_HEAD = """# Mesh files that people bring

Made by `python -m tests.geometry.corpus --page` from the scripts beside this page; the files
themselves are written by `python -m tests.geometry.corpus FOLDER`, with `answers.json` for
readers other than ours. `tests/geometry/test_corpus.py` holds every row.

Volume, area and NSVR are what is right; each file is read to these within its tolerance (a
relative error of volume and of area). A refused file has the sentence that refuses it.

## Why the readers are our own

Measured on these files but for URDF, folders and those of several bodies (203 that are right, 72
to be refused), polygons cut as the library cuts them:

| library | right | wrong in silence | refused | ends the process | takes what it should refuse |
|-|-|-|-|-|-|
| trimesh 5.2.0 | 117 of 203 | 36 | 50 | 0 | 34 of 72 |
| assimp (assimp-py 1.1.0) | 165 of 203 | 10 | 26 | 4 | 27 of 72 |
| meshio 5.3.5 | 41 of 203 | 13 | 149 | 0 | 6 of 72 |
| tinyobjloader 2.0.0rc13, OBJ alone | 49 of 55 | 1 | 5 | 0 | 12 of 23 |

The best of them, assimp, holds corners in 32 bits and ends the process on four files. A reader
that is lenient cannot give a reason, and what it skips is missing without a word. Cutting polygons
is a library's: manifold3d, which is here for other things, keeps corners that lie in line with
their neighbours; mapbox-earcut leaves them out, and the neighbouring faces gape.
"""


def page() -> str:
    """The whole page."""
    parts = [_HEAD]
    for kind, cases in corpus().items():
        good = [case for case in cases if case.solid is not None]
        bad = [case for case in cases if case.solid is None]
        parts.append(f"\n## {kind}: {len(good)} read, {len(bad)} refused\n")
        parts.append("| file | what it is | V [cm³] | A [cm²] | NSVR | bodies | within |")
        parts.append("|-|-|-|-|-|-|-|")
        parts += [_read(case) for case in good]
        if bad:
            parts.append("\n| file | what it is | why it is refused |\n|-|-|-|")
            parts += [_refused(case) for case in bad]
    parts.append("\n## Folders: one object in several files, names, units\n")
    parts.append("| folder | what it is | object | file | unit | copies left out |")
    parts.append("|-|-|-|-|-|-|")
    for folder in folders():
        parts += _objects(folder)
    return "\n".join(parts) + "\n"


def _objects(case: FolderCase) -> list[str]:
    assert objects_of(case) == case.objects, case.name
    return [
        f"| `{case.name}` | {case.what} | `{name}` | `{known.source}` | {known.unit} "
        f"| {', '.join(f'`{path}`' for path in known.copies) or 'none'} |"
        for name, known in sorted(case.objects.items())
    ]


def _read(case: Case) -> str:
    item = read(case)
    assert not isinstance(item, MeshError), item
    assert case.solid is not None
    worst = max(
        abs(volume(item.mesh) / case.solid.volume_m3 - 1),
        abs(surface_area(outer_surface(item.mesh)) / case.solid.area_m2 - 1),
    )
    assert worst <= case.tolerance, (case.name, worst)
    return (
        f"| `{case.name}` | {case.what} | {case.solid.volume_m3 * 1e6:.4f} "
        f"| {case.solid.area_m2 * 1e4:.4f} | {case.solid.nsvr:.4f} | {case.bodies} "
        f"| {case.tolerance:.0e} |"
    )


def _refused(case: Case) -> str:
    error = read(case)
    assert isinstance(error, MeshError), f"{case.name} was not refused"
    sentence = str(error).replace("|", "\\|")
    return f"| `{case.name}` | {case.what} | {sentence} |"
