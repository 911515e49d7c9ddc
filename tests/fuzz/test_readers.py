"""What fuzzing found stays found, and a little more is looked for each time."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.readers import READERS, ROOT, answered

FAILURES = Path(__file__).parent / "failures"
SECONDS = 4
PICKLES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "shelve", "marshal"}


@pytest.mark.parametrize("reader", READERS)
def test_whole_files_are_read(reader: str) -> None:
    read, seeds = READERS[reader]
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


@pytest.mark.parametrize("reader", READERS)
def test_a_short_search_finds_nothing(reader: str, tmp_path: Path) -> None:
    pytest.importorskip("atheris", reason="atheris has no wheel for this Python")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "tests.fuzz", reader, "--seconds", str(SECONDS)),
            *("--failures", str(tmp_path / "failures"), "--corpus", str(tmp_path / "corpus")),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert list((tmp_path / "corpus" / reader).iterdir())
    assert not list((tmp_path / "failures" / reader).iterdir())


def test_nothing_is_ever_unpickled() -> None:
    """A pickle runs code when it is read: no module of ours imports one, or asks a library to."""
    for path in sorted(
        p for top in ("pipeline", "stages", "schemas") for p in (ROOT / top).rglob("*.py")
    ):
        for node in ast.walk(ast.parse(path.read_bytes())):
            where = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.Import):
                assert not {a.name.split(".")[0] for a in node.names} & PICKLES, where
            elif isinstance(node, ast.ImportFrom):
                assert (node.module or "").split(".")[0] not in PICKLES, where
            elif isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in ("torch.load", "torch.save", "eval", "exec"), where
                for keyword in node.keywords:
                    assert keyword.arg != "allow_pickle" or not ast.literal_eval(keyword.value), (
                        where
                    )
