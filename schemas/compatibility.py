"""What was released stays readable: ``python -m schemas.compatibility``.

Beside the sources of a version lies ``released.json``: every field of every message as it was
last released. A field may be added; one that is removed, renumbered, renamed or of another type
is a breaking change, and belongs into a new version's folder. ``--release`` writes the list anew
when a version is released.
"""

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path

from google.protobuf.descriptor import Descriptor, FieldDescriptor

ROOT = Path(__file__).resolve().parent.parent
RELEASED = "released.json"

Fields = dict[str, str]  # field number → "label type name"
Messages = dict[str, Fields]


def messages_of(version: Path) -> Messages:
    """Every message of a version's folder as its generated modules have it."""
    found: Messages = {}
    for source in sorted(version.glob("*.proto")):
        name = ".".join([*version.relative_to(ROOT).parts, f"{source.stem}_pb2"])
        module = importlib.import_module(name)
        for message in module.DESCRIPTOR.message_types_by_name.values():
            found |= dict(_described(message))
    return dict(sorted(found.items()))


def breaking_changes(now: Messages, released: Messages) -> list[str]:
    """What a reader of ``released`` could no longer read, in words."""
    found = []
    for message, fields in released.items():
        if message not in now:
            found.append(f"{message} was removed")
            continue
        for number, field in fields.items():
            here = now[message].get(number)
            if here is None:
                moved = [n for n, other in now[message].items() if other == field]
                how = f"was renumbered to {moved[0]}" if moved else "was removed"
                found.append(f"{message}: field {number} '{field}' {how}")
            elif here != field:
                found.append(f"{message}: field {number} was '{field}' and is '{here}'")
    return found


def read_released(version: Path) -> Messages:
    """The list that was written at the last release of a version."""
    listed: Messages = json.loads((version / RELEASED).read_text())
    return listed


def versions() -> list[Path]:
    """The folder of every schema version."""
    return sorted(path for path in ROOT.glob("schemas/softgrip/v*") if path.is_dir())


def problems() -> list[str]:
    """Breaking changes of every released version, and versions that were never released."""
    found = []
    for version in versions():
        if not (version / RELEASED).is_file():
            found.append(f"{version.name} has no {RELEASED}: add it with --release")
            continue
        found += breaking_changes(messages_of(version), read_released(version))
    return found


def release() -> None:
    """Write down every version as it is released."""
    for version in versions():
        (version / RELEASED).write_text(json.dumps(messages_of(version), indent=1) + "\n")


def main() -> int:
    """Check every version; non-zero where something breaks."""
    found = problems()
    for problem in found:
        sys.stderr.write(f"{problem}. A breaking change goes into a new version's folder\n")
    return 1 if found else 0


def _described(message: Descriptor) -> Iterator[tuple[str, Fields]]:
    yield (
        message.full_name,
        {str(field.number): _field(field) for field in sorted(message.fields, key=_number)},
    )
    for nested in message.nested_types:
        yield from _described(nested)


def _field(field: FieldDescriptor) -> str:
    kinds = (field.message_type, field.enum_type)
    named = next((kind.full_name for kind in kinds if kind is not None), None)
    repeated = "repeated " if field.is_repeated else ""
    return f"{repeated}{named or _SCALARS[field.type]} {field.name}"


def _number(field: FieldDescriptor) -> int:
    return field.number


_SCALARS = {
    getattr(FieldDescriptor, name): name.removeprefix("TYPE_").lower()
    for name in dir(FieldDescriptor)
    if name.startswith("TYPE_")
}


if __name__ == "__main__":
    if "--release" in sys.argv[1:]:
        release()
    sys.exit(main())
