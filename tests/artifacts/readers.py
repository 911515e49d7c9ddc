"""Readers of MCAP in other languages than ours: TypeScript by Node, Rust by Rerun, Go by `mcap`."""

import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from pipeline.artifacts import open_artifact

NODE_FOLDER = Path(__file__).parent / "node"
TIMEOUT_S = 120


def by_node(paths: list[Path]) -> list[dict[str, Any]]:
    """What the TypeScript reader finds in each file; skips the test where it is not installed."""
    if shutil.which("node") is None:
        pytest.skip("Node is not installed: see 'make doctor'")
    if not (NODE_FOLDER / "node_modules").is_dir():
        if os.environ.get("CI"):
            pytest.fail("Node is here and its MCAP reader is not: run 'make reader'")
        pytest.skip("the TypeScript reader is not installed: run 'make reader'")
    done = subprocess.run(
        ["node", "read.mjs", *map(str, (path.resolve() for path in paths))],
        cwd=NODE_FOLDER,
        capture_output=True,
        text=True,
        check=False,
        timeout=TIMEOUT_S,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def by_us(path: Path) -> dict[str, Any]:
    """The same of our own reader, and of the bytes as the Python library gives them."""
    with open_artifact(path) as artifact:
        artifact.check()
        counts = {topic: list(found) for topic, found in artifact.counts().items()}
        attachments = {
            name: hashlib.sha256(artifact.attachment(name)).hexdigest()
            for name in artifact.attachment_sizes()
        }
        metadata = {"provenance": artifact.provenance.to_metadata()}
    digest = hashlib.sha256()
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for _, _, message in reader.iter_messages():
            digest.update(message.data)
        summary = reader.get_summary()
    assert summary is not None
    return {
        "messages": sum(count for _, count in counts.values()),
        "data_whole": True,
        "counts": counts,
        "metadata": metadata,
        "attachments": attachments,
        "channels": {channel.topic: channel.metadata for channel in summary.channels.values()},
        "schemas": {
            schema.name: hashlib.sha256(schema.data).hexdigest()
            for schema in summary.schemas.values()
        },
        "messages_sha256": digest.hexdigest(),
    }
