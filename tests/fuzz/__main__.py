"""Coverage-guided fuzzing of one reader: ``python -m tests.fuzz mcap --seconds 60``.

What makes a reader fail is written to tests/fuzz/failures/<reader>, where the tests replay it
for good. The corpus of what reached new code is kept in .cache/fuzz from call to call.
"""

import hashlib
import resource
from pathlib import Path
from typing import Annotated

import atheris
import typer

INSTRUMENTED = ["pipeline", "mcap", "tomllib", "trimesh", "safetensors"]
# numba cannot compile a function that atheris has rewritten.
COMPILED = [
    ".".join(file.with_suffix("").parts)
    for file in sorted(Path("pipeline").rglob("*.py"))
    if "njit" in (text := file.read_text(encoding="utf-8")) or "gripper.compiled" in text
]
FAILURES = Path("tests/fuzz/failures")
LONGEST_INPUT_BYTES = 1 << 16
SLOWEST_S = 60
MOST_MIB = 2048  # beyond what the process began with

with atheris.instrument_imports(include=INSTRUMENTED, exclude=COMPILED):
    from pipeline.errors import SoftgripError
    from tests.fuzz.readers import READERS


def main(
    reader: Annotated[str, typer.Argument(help=", ".join(READERS))],
    seconds: Annotated[int, typer.Option(min=1, help="how long to look")] = 60,
    failures: Annotated[Path, typer.Option(help="where findings are written")] = FAILURES,
    corpus: Annotated[Path, typer.Option(help="inputs found so far")] = Path(".cache/fuzz"),
    seed: Annotated[int, typer.Option(help="of the mutations")] = 1,
) -> None:
    """Look for bytes that a reader neither reads nor refuses in words."""
    read, seeds = READERS[reader]
    corpus, failures = corpus / reader, failures / reader
    corpus.mkdir(parents=True, exist_ok=True)
    failures.mkdir(parents=True, exist_ok=True)
    for data in seeds():
        (corpus / hashlib.sha1(data).hexdigest()).write_bytes(data)

    def once(data: bytes) -> None:
        try:
            read(data)
        except SoftgripError:
            return
        except Exception:
            (failures / hashlib.sha1(data).hexdigest()).write_bytes(data)
            raise

    # libFuzzer asks for the most memory ever held, and Linux lets a process inherit that figure
    # from the one that started it.
    held_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    flags = {
        "max_total_time": seconds,
        "max_len": LONGEST_INPUT_BYTES,
        "timeout": SLOWEST_S,
        "rss_limit_mb": held_mib + MOST_MIB,
        "seed": seed,
        "artifact_prefix": f"{failures}/",
        "print_final_stats": 1,
    }
    atheris.Setup([reader, *(f"-{k}={v}" for k, v in flags.items()), str(corpus)], once)
    atheris.Fuzz()


if __name__ == "__main__":
    typer.run(main)
