"""Regenerate the *_pb2 modules from the .proto sources: ``python -m schemas.generate``.

With ``--check`` nothing is written; the exit code says whether what is checked
in is what the sources give, and whether it still reads what was released.
"""

import sys
import tempfile
from importlib.resources import files
from pathlib import Path

from grpc_tools import protoc

from schemas import compatibility

ROOT = Path(__file__).resolve().parent.parent


def generate(into: Path) -> list[Path]:
    """Compile every schemas/softgrip/v*/*.proto below ``into``; the modules written."""
    sources = sorted(str(p.relative_to(ROOT)) for p in ROOT.glob("schemas/softgrip/v*/*.proto"))
    well_known = str(files("grpc_tools") / "_proto")
    code = protoc.main(
        [
            "protoc",
            f"-I{ROOT}",
            f"-I{well_known}",
            f"--python_out={into}",
            f"--pyi_out={into}",
            *sources,
        ]
    )
    if code != 0:
        raise SystemExit(code)
    return sorted(
        [*into.glob("schemas/softgrip/v*/*_pb2.py"), *into.glob("schemas/softgrip/v*/*_pb2.pyi")]
    )


def main() -> int:
    if "--check" not in sys.argv[1:]:
        generate(ROOT)
        return 0
    with tempfile.TemporaryDirectory() as scratch:
        stale = [
            str(fresh.relative_to(scratch))
            for fresh in generate(Path(scratch))
            if not (there := ROOT / fresh.relative_to(scratch)).is_file()
            or there.read_bytes() != fresh.read_bytes()
        ]
    for name in stale:
        sys.stderr.write(f"{name} is not what its .proto gives: run 'python -m schemas.generate'\n")
    return 1 if stale else compatibility.main()


if __name__ == "__main__":
    sys.exit(main())
