"""A configuration as the run.toml that gives it: every value, table by table."""

import json
from typing import Any

from pipeline.config.section import Section
from pipeline.config.tree import RunConfig


def as_toml(config: RunConfig) -> str:
    """Text that `load_run_config` reads as the same configuration."""
    lines: list[str] = []
    _table(lines, "", config)
    return "\n".join(lines).lstrip("\n") + "\n"


def _table(lines: list[str], name: str, section: Section) -> None:
    """A section's own values, then its tables."""
    values = {key: getattr(section, key) for key in type(section).model_fields}
    tables = {key: value for key, value in values.items() if isinstance(value, Section)}
    if name:
        lines += ["", f"[{name}]"]
    # TOML has no word for nothing: what is None is left out, as it is None unless named.
    lines += [
        f"{key} = {_value(value)}"
        for key, value in values.items()
        if key not in tables and value is not None
    ]
    for key, table in tables.items():
        _table(lines, f"{name}.{key}" if name else key, table)


def _value(value: Any) -> str:
    """A scalar, or an array of them; JSON writes these as TOML does."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    return json.dumps(value, ensure_ascii=False)
