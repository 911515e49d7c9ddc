"""Digests of files by content; what did not change is not read again."""

import json
from pathlib import Path
from typing import Any

from pipeline.artifacts.publishing import file_sha256, publish_bytes

MEMO = "hashes.json"  # in a run's state: what all its commands remember


def content_digests(files: dict[str, Path], memo: Path) -> dict[str, str]:
    """SHA-256 of each file; one unchanged in size, date and inode is not read again."""
    try:
        known: dict[str, Any] = json.loads(memo.read_text())
    except (FileNotFoundError, json.JSONDecodeError):
        known = {}
    digests, fresh = {}, {}
    for name, path in sorted(files.items()):
        status = path.stat()
        mark = [status.st_size, status.st_mtime_ns, status.st_ino]
        remembered = known.get(str(path.resolve()))
        if remembered is not None and remembered["mark"] == mark:
            digests[name] = remembered["sha256"]
        else:
            digests[name] = file_sha256(path)
        fresh[str(path.resolve())] = {"mark": mark, "sha256": digests[name]}
    if any(known.get(path) != entry for path, entry in fresh.items()):
        publish_bytes(memo, json.dumps({**known, **fresh}, indent=1, sort_keys=True).encode())
    return digests
