"""What fuzzing found stays found, and a little more is looked for each time."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.readers import KINDS, READERS, ROOT, answered

FAILURES = Path(__file__).parent / "failures"
SECONDS = 8
FORBIDDEN = ("torch.load", "torch.save", "eval", "exec")
# A run's own processes hand each other pickles, as multiprocessing and Ray do; no file is read so.
BETWEEN_OWN_PROCESSES = {
    ROOT / "pipeline/execution/stored_items.py",
    ROOT / "pipeline/execution/isolated.py",
    ROOT / "pipeline/execution/packed_items.py",
    ROOT / "pipeline/benchmarks/asked.py",
    ROOT / "pipeline/benchmarks/commits.py",
}
PICKLES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "shelve", "marshal"}


def test_whole_files_are_read() -> None:
    read, seeds = READERS["any"]
    assert {answered(read, data) for data in seeds()} == {"read"}


@pytest.mark.parametrize(
    "found",
    sorted(path for path in FAILURES.glob("*/*") if path.is_file()),
    ids=lambda path: f"{path.parent.name}-{path.name[:16]}",
)
def test_what_was_found_is_answered(found: Path) -> None:
    """Files that once made a reader fail, by anything but words."""
    read, _ = READERS[found.parent.name]
    assert answered(read, found.read_bytes())


def test_a_short_search_finds_nothing(tmp_path: Path) -> None:
    """Of all readers by one process: most of its time goes into instrumenting their code."""
    pytest.importorskip("atheris", reason="atheris has no wheel for this Python")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "tests.fuzz", "any", "--seconds", str(SECONDS)),
            *("--failures", str(tmp_path / "failures"), "--corpus", str(tmp_path / "corpus")),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    reached = {path.read_bytes()[0] for path in (tmp_path / "corpus" / "any").iterdir()}
    assert len({first % len(KINDS) for first in reached}) == len(KINDS)
    assert not list((tmp_path / "failures" / "any").iterdir())


def name_of(called: ast.expr) -> str:
    """``f`` and ``module.f`` as they are written; of anything longer nothing."""
    if isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name):
        return f"{called.value.id}.{called.attr}"
    return called.id if isinstance(called, ast.Name) else ""


def test_nothing_is_ever_unpickled() -> None:
    """A pickle runs code when it is read: no reader of files imports one, or asks for it."""
    for path in sorted(
        p for top in ("pipeline", "stages", "schemas") for p in (ROOT / top).rglob("*.py")
    ):
        if path in BETWEEN_OWN_PROCESSES:
            continue
        for node in ast.walk(ast.parse(path.read_bytes())):
            where = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.Import):
                assert not {a.name.split(".")[0] for a in node.names} & PICKLES, where
            elif isinstance(node, ast.ImportFrom):
                assert (node.module or "").split(".")[0] not in PICKLES, where
            elif isinstance(node, ast.Call):
                assert name_of(node.func) not in FORBIDDEN, where
                for keyword in node.keywords:
                    assert keyword.arg != "allow_pickle" or not ast.literal_eval(keyword.value), (
                        where
                    )
