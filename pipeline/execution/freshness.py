"""Keys of what a stage's artifact and its recording depend on, by content and not by date.

A key holds four parts: the digests of the configuration sections the stage reads, of every source
file its module reaches by import, of the machine (Python, the packages that change results, the
renderer), and of its inputs' content. An artifact is fresh when it carries the key of today. A
recording is drawn from a finished artifact and has a key of its own, so that a change of code that
only draws changes that key alone.
"""

import hashlib
import json
import platform
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.artifacts.digests import content_digests
from pipeline.config import RunConfig, section_digest
from pipeline.execution.code import DRAWING, RUNNING, code_digests
from pipeline.execution.packages import package_versions

PARTS = ("config", "code", "machine", "inputs")
CUT_SHORT = "cut_short"  # entry of the machine's part: inputs left out for want of time or memory


@dataclass(frozen=True)
class Key:
    """What a result depends on, part by part.

    Attributes
    ----------
    config
        Configuration section → digest of its values.
    code
        Source file → digest of its code.
    machine
        ``python``, ``renderer`` and packages → version, in words.
    inputs
        Input → digest of its content.

    A result from which inputs were left out because a process ran out of time or memory, or died,
    has a key of its own, which no machine has: it is never fresh.
    """

    config: dict[str, str]
    code: dict[str, str]
    machine: dict[str, str]
    inputs: dict[str, str]

    @property
    def digest(self) -> str:
        """SHA-256 over all parts."""
        return _digest(self._parts())

    @property
    def config_digest(self) -> str:
        """SHA-256 over the configuration part."""
        return _digest(self.config)

    @property
    def code_digest(self) -> str:
        """SHA-256 over the code part."""
        return _digest(self.code)

    @property
    def is_final(self) -> bool:
        """Whether all inputs were worked on to their end."""
        return CUT_SHORT not in self.machine

    def cut_short(self, names: Sequence[str]) -> "Key":
        """The key of a result that lacks these inputs; with none, the key itself."""
        if not names:
            return self
        return replace(self, machine=self.machine | {CUT_SHORT: ", ".join(sorted(names))})

    def to_json(self) -> str:
        """The parts as text, stable from run to run."""
        return json.dumps(self._parts(), indent=1, sort_keys=True) + "\n"

    def differences(self, older: "Key") -> list[str]:
        """What changed since ``older``, in words."""
        found = []
        for part, word in (("config", "configuration"), ("code", "code"), ("inputs", "input")):
            now, then = getattr(self, part), getattr(older, part)
            found += [f"{word} {name} changed" for name in now if now[name] != then.get(name)]
            found += [f"{word} {name} is gone" for name in then if name not in now]
        if not older.is_final:
            found.append(f"not finished, and tried again: {older.machine[CUT_SHORT]}")
        for name in sorted((self.machine | older.machine).keys() - {CUT_SHORT}):
            now, then = (key.machine.get(name, "absent") for key in (self, older))
            found += [f"{name} was {then}, is {now}"] if now != then else []
        return found

    def _parts(self) -> dict[str, dict[str, str]]:
        return {part: getattr(self, part) for part in PARTS}


def key_from_json(text: str) -> Key:
    """Read back the text that `Key.to_json` gives.

    Parameters
    ----------
    text
        The key as JSON.

    Returns
    -------
    The key.

    Raises
    ------
    ValueError
        The text is no key, or the key of an earlier softgrip, which had other parts.
    """
    parts = json.loads(text)
    if not isinstance(parts, dict) or set(parts) != set(PARTS):
        raise ValueError("it is not the key of this softgrip")
    return Key(**parts)


def stage_key(
    config: RunConfig,
    sections: tuple[str, ...],
    module: str,
    inputs: dict[str, Path],
    memo: Path,
    renderer: str = "",
    without: tuple[str, ...] = DRAWING + RUNNING,
) -> Key:
    """The key of a stage's artifact as things are now.

    Parameters
    ----------
    config
        The run's configuration.
    sections
        Configuration sections that the stage reads, dotted for a part of one.
    module
        The Python module that runs it.
    inputs
        Name → file; contents are hashed.
    memo
        File that keeps the hashes of files that did not change.
    renderer
        The renderer of its pictures; empty where it renders none.
    without
        Modules and packages of ours that cannot change the artifact.

    Returns
    -------
    The key.
    """
    machine = {"python": platform.python_version(), **package_versions(module, without)}
    return Key(
        config={name: section_digest(config, (name,)) for name in sections},
        code=code_digests(module, without),
        machine=machine | ({"renderer": renderer} if renderer else {}),
        inputs=content_digests(inputs, memo),
    )


def drawing_key(config: RunConfig, shown: tuple[str, ...], module: str, artifact: Key) -> Key:
    """The key of a recording, which is drawn from a finished artifact.

    Parameters
    ----------
    config
        The run's configuration.
    shown
        Configuration that says how much is shown, dotted.
    module
        The Python module that draws.
    artifact
        The key of the artifact that is drawn.

    Returns
    -------
    The key.
    """
    return Key(
        config={name: section_digest(config, (name,)) for name in shown},
        code=code_digests(module, without=RUNNING),
        machine=package_versions(module, without=RUNNING),
        inputs={"artifact": artifact.digest},
    )


def _digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
