"""What refusing a hostile file costs: processor time and memory, told by the kernel.

All files of a kind are tried by one fresh process, ``python -m tests.refusals``, after it has
read honest ones, so that what is measured is the reading and no import.
"""

import importlib
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from pipeline.errors import SoftgripError

ROOT = Path(__file__).resolve().parents[1]
MOST_SECONDS = 1.0
MOST_BYTES = 200 * 10**6
# Above this, a reader that believes a file gets no more and does not take the machine with it.
_ROOM_BYTES = 4 << 30


def assert_refused_cheaply(
    read: Callable[[Path], object], honest: Sequence[Path], hostile: Sequence[Path]
) -> None:
    """Each hostile file is refused with its name, each honest one read, in < 1 s and < 200 MB.

    read : a function at the top of its module. A refusal for want of memory does not count: the
        reader then believed what the file declares.
    """
    names = [*honest, *honest, *hostile]  # the first time round, modules are imported
    said = subprocess.run(
        [
            *(sys.executable, "-m", "tests.refusals", read.__module__, read.__qualname__),
            *map(str, names),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.returncode == 0, said.stderr[-3000:]
    told = [json.loads(line) for line in said.stdout.splitlines()]
    assert len(told) == len(names)
    for path, answer in list(zip(names, told, strict=True))[len(honest) :]:
        sentence, told_of = answer["sentence"], (path.name, answer)
        if path in honest:
            assert sentence == "", told_of
        else:
            assert path.name in sentence, told_of
            assert "Memory" not in sentence, told_of
            assert "alloc" not in sentence, told_of
        assert answer["seconds"] < MOST_SECONDS, told_of
        assert answer["bytes"] < MOST_BYTES, told_of


def _answers(module: str, function: str, names: list[str]) -> None:
    read = getattr(importlib.import_module(module), function)
    mapped = _status_bytes("VmSize") + _ROOM_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (mapped, mapped))
    for name in names:
        Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew
        before, started = _status_bytes("VmRSS"), time.process_time()
        sentence = ""
        try:
            read(Path(name))
        except SoftgripError as error:
            sentence = str(error)
        seconds = time.process_time() - started
        peak = _status_bytes("VmHWM") - before
        answer = {"sentence": sentence, "seconds": seconds, "bytes": peak}
        sys.stdout.write(json.dumps(answer) + "\n")


def _status_bytes(field: str) -> int:
    (line,) = (x for x in Path("/proc/self/status").read_text().splitlines() if field in x)
    return int(line.split()[1]) << 10


if __name__ == "__main__":
    _answers(sys.argv[1], sys.argv[2], sys.argv[3:])
