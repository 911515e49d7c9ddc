"""Fresh by content, not by date: what a stage's result depends on, as one key.

A key holds three parts: the digests of the configuration sections the stage
reads, of every source file its module reaches by import, and of its inputs'
content. A stage is fresh when its artifact carries the key of today.
"""

import ast
import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from pipeline.artifacts.publishing import file_sha256, publish_bytes
from pipeline.config import RunConfig, section_digest

ROOT = Path(__file__).resolve().parents[2]
OUR_PACKAGES = ("pipeline", "stages", "schemas")
VALUES_ONLY = "pipeline.config"  # its values are digested themselves, its text decides nothing


@dataclass(frozen=True)
class Key:
    """What a stage's result depends on, part by part."""

    config: dict[str, str]
    code: dict[str, str]
    inputs: dict[str, str]

    @property
    def digest(self) -> str:
        """SHA-256 over all parts."""
        return _digest({"config": self.config, "code": self.code, "inputs": self.inputs})

    @property
    def config_digest(self) -> str:
        """SHA-256 over the configuration part."""
        return _digest(self.config)

    @property
    def code_digest(self) -> str:
        """SHA-256 over the code part."""
        return _digest(self.code)

    def to_json(self) -> str:
        """The parts as text, stable from run to run."""
        parts = {"config": self.config, "code": self.code, "inputs": self.inputs}
        return json.dumps(parts, indent=1, sort_keys=True) + "\n"

    def differences(self, older: "Key") -> list[str]:
        """What changed since ``older``, in words."""
        found = []
        for part, word in (("config", "configuration"), ("code", "code"), ("inputs", "input")):
            now, then = getattr(self, part), getattr(older, part)
            found += [f"{word} {name} changed" for name in now if now[name] != then.get(name)]
            found += [f"{word} {name} is gone" for name in then if name not in now]
        return found


def key_from_json(text: str) -> Key:
    """Read back ``Key.to_json``."""
    parts = json.loads(text)
    return Key(config=parts["config"], code=parts["code"], inputs=parts["inputs"])


def stage_key(
    config: RunConfig, sections: tuple[str, ...], module: str, inputs: dict[str, Path], memo: Path
) -> Key:
    """The key of a stage as things are now.

    sections : configuration sections the stage reads, dotted for a part of one.
    inputs : name → file; contents are hashed, with ``memo`` remembering what did not change.
    """
    return Key(
        config={name: section_digest(config, (name,)) for name in sections},
        code=code_digests(module),
        inputs=content_digests(inputs, memo),
    )


@lru_cache
def code_digests(module: str) -> dict[str, str]:
    """SHA-256 of each of our source files that ``module`` reaches by import."""
    found: dict[str, str] = {}
    waiting = [module]
    seen = set()
    while waiting:
        name = waiting.pop()
        path = _source_of(name)
        if name in seen or path is None:
            continue
        seen.add(name)
        source = path.read_bytes()
        found[str(path.relative_to(ROOT))] = hashlib.sha256(source).hexdigest()
        waiting += _imports(source)
        waiting += [name.rpartition(".")[0]] if "." in name else []
    return dict(sorted(found.items()))


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


def _imports(source: bytes) -> list[str]:
    """Names of our modules that a source file imports, also inside functions."""
    names = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names.append(node.module)
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    ours = [name for name in names if name.split(".")[0] in OUR_PACKAGES]
    return [name for name in ours if not name.startswith(VALUES_ONLY)]


def _source_of(module: str) -> Path | None:
    base = ROOT.joinpath(*module.split("."))
    for candidate in (base.with_suffix(".py"), base / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def _digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
