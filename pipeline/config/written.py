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
    lists = {key: value for key, value in values.items() if _is_list_of_tables(value)}
    if name:
        lines += ["", f"[{name}]"]
    # TOML has no word for nothing: what is None is left out, as it is None unless named.
    lines += [
        f"{key} = {_value(value)}"
        for key, value in values.items()
        if key not in tables and key not in lists and value is not None
    ]
    for key, table in tables.items():
        _table(lines, f"{name}.{key}" if name else key, table)
    for key, entries in lists.items():
        for entry in entries:
            lines += ["", f"[[{name}.{key}]]" if name else f"[[{key}]]"]
            lines += [
                f"{field} = {_value(found)}"
                for field in type(entry).model_fields
                if (found := getattr(entry, field)) is not None
            ]


def _is_list_of_tables(value: Any) -> bool:
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], Section)


def _value(value: Any) -> str:
    """A scalar, or an array of them; JSON writes these as TOML does."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    return json.dumps(value, ensure_ascii=False)
