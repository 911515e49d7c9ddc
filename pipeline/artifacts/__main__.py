"""``python -m pipeline.artifacts inspect FILE`` and ``verify FILE``."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from pipeline.artifacts.checksums import verify_folder
from pipeline.artifacts.inspection import Contents, read_contents, verify_files
from pipeline.errors import SoftgripError

EXIT_FAILURE = 1  # what shells read as a failure

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
File = Annotated[Path, typer.Argument(help="an .mcap of a run")]
Made = Annotated[Path, typer.Argument(help="an .mcap of a run, or a published folder")]


@app.command()
def inspect(file: File) -> None:
    """Stage, versions, provenance and counts of an artifact."""
    sys.stdout.write(describe(read_contents(file)))


@app.command()
def verify(
    file: Made,
    mesh_dir: Annotated[
        Path | None, typer.Option(envvar="MESH_DIR", help="folder of the meshes it was made from")
    ] = None,
) -> None:
    """Hash a file and all it was made from, up to the meshes; non-zero where one differs.

    Of a published folder, every file is compared with the list of digests.
    """
    wrong = whole = 0
    findings = verify_folder(file) if file.is_dir() else verify_files(file, mesh_dir)
    for finding in findings:
        if finding.problem:
            wrong += 1
            sys.stdout.write(f"wrong  {finding.path}: {finding.problem}\n")
        else:
            whole += 1
            sys.stdout.write(f"well   {finding.path}\n")
    sys.stdout.write(f"{whole} files as recorded, {wrong} not\n")
    if wrong:
        raise typer.Exit(EXIT_FAILURE)


def describe(contents: Contents) -> str:
    """The report of ``inspect``."""
    made = contents.provenance
    lines = [
        f"{contents.path}: {contents.size_bytes / 1e6:.2f} MB",
        f"stage      {made.stage}, seed {made.seed}",
        f"versions   softgrip {made.package_version}, schemas {made.schema_version}",
        f"key        {made.key}",
        f"config     {made.config_digest}",
        f"code       {made.code_digest}",
        *(f"made with  {name} {value}" for name, value in made.machine.items()),
        *(f"input      {entry.path}  {entry.sha256}" for entry in made.inputs),
        *(f"topic      {t}: {n} {schema}" for t, (schema, n) in contents.counts.items()),
        *(f"attached   {name}: {size} bytes" for name, size in contents.attachments.items()),
        *(f"shard      {name}: {samples} samples" for name, samples in contents.shards.items()),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Command line; failures end in one sentence."""
    try:
        app()
    except SoftgripError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(EXIT_FAILURE)


if __name__ == "__main__":
    main()
