"""Code is followed by import and counts by what Python makes of it, not by its words."""

from pathlib import Path

import pytest

from pipeline.execution import code
from pipeline.execution.code import code_digests, reached_modules
from stages.graph import MADE

LIMITS = '''"""Limits of the pad."""

from pipeline.config.grasps import CELL


def upper(mu: float) -> float:
    """Eq. (8)."""
    return mu * CELL  # of F_v
'''
GRASPS = '''"""The grasps."""

from pydantic import BaseModel, model_validator

CELL = 0.1


class Pad(BaseModel):
    """The pad."""

    radius: float = 0.025

    @property
    def area(self) -> float:
        return 3.14 * self.radius**2

    @model_validator(mode="after")
    def _is_there(self):
        if self.radius == 0:
            raise ValueError("none")
        return self

    def within(self, r: float) -> bool:
        return r < self.radius
'''
PROJECT = {
    "pipeline/__init__.py": "",
    "pipeline/limits.py": LIMITS,
    "pipeline/recording/__init__.py": "",
    "pipeline/recording/grasps.py": "import pipeline.limits\nCOLOUR = 1\n",
    "pipeline/config/__init__.py": "",
    "pipeline/config/grasps.py": GRASPS,
    "stages/__init__.py": "",
    "stages/grasps.py": (
        "from pipeline.recording.grasps import COLOUR\n"
        "def build() -> None:\n"
        "    from pipeline import limits\n"
    ),
}


@pytest.fixture
def digests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> "Digests":
    return Digests(tmp_path, monkeypatch)


class Digests:
    """Digests of the small project with one edit."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._folder, self._patch, self._written = folder, monkeypatch, 0

    def of(self, module: str = "stages.grasps", **options: tuple[str, ...]) -> dict[str, str]:
        return code_digests(module, **options)

    def edited(self, file: str = "", old: str = "", new: str = "") -> "Digests":
        root = self._folder / str(self._written)
        self._written += 1
        assert not file or old in PROJECT[file]
        for name, text in PROJECT.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text.replace(old, new) if name == file else text)
        self._patch.setattr(code, "ROOT", root)
        return self

    def changed(self, file: str, old: str, new: str) -> list[str]:
        """Files whose digest an edit changes."""
        before, after = self.edited().of(), self.edited(file, old, new).of()
        assert before.keys() == after.keys()
        return [name for name in before if before[name] != after[name]]


def test_what_is_reached_by_import_counts_and_what_only_draws_does_not(digests: Digests) -> None:
    found = digests.edited().of()
    assert list(found) == [
        "pipeline/__init__.py",
        "pipeline/config/grasps.py",
        "pipeline/limits.py",
        "stages/__init__.py",
        "stages/grasps.py",
    ]
    assert "pipeline/recording/grasps.py" in digests.edited().of(
        "pipeline.recording.grasps", without=()
    )


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""Limits of the pad."""', '"""The limits of the pad, of Eq. (8)."""'),
        ('"""Limits of the pad."""\n', ""),
        ('    """Eq. (8)."""\n', ""),
        ("# of F_v", "# of the vacuum force"),
        ("mu * CELL", "(mu *\n            CELL)"),
    ],
)
def test_words_and_layout_change_no_digest(digests: Digests, old: str, new: str) -> None:
    assert digests.changed("pipeline/limits.py", old, new) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [("mu * CELL", "mu + CELL"), ("return mu", 'return "x" and mu'), ("upper", "higher")],
)
def test_code_changes_the_digest_of_its_file_alone(digests: Digests, old: str, new: str) -> None:
    assert digests.changed("pipeline/limits.py", old, new) == ["pipeline/limits.py"]


def test_drawing_code_changes_nothing_of_an_artifact(digests: Digests) -> None:
    assert digests.changed("pipeline/recording/grasps.py", "COLOUR = 1", "COLOUR = 2") == []


@pytest.mark.parametrize(
    ("old", "new", "counts"),
    [
        ("CELL = 0.1", "CELL = 0.2", True),
        ("r < self", "r <= self", True),
        # These show in the values of a section, or in nothing that is accepted.
        ("= 0.025", "= 0.03", False),
        ("3.14", "3.1416", False),
        ("radius == 0", "radius <= 0", False),
        ('"""The pad."""', '"""The soft pad."""', False),
    ],
)
def test_of_configuration_its_constants_and_methods_count(
    digests: Digests, old: str, new: str, counts: bool
) -> None:
    file = "pipeline/config/grasps.py"
    assert digests.changed(file, old, new) == ([file] if counts else [])


@pytest.mark.parametrize("name", sorted(MADE))
def test_a_stage_reaches_itself_and_nothing_that_draws_or_only_runs(name: str) -> None:
    module = MADE[name].module
    assert f"{module.replace('.', '/')}.py" in code_digests(module)
    assert not any(path.startswith("pipeline/recording") for path in code_digests(module))
    assert not set(code.RUNNING) & set(reached_modules(module))
    assert all(code_digests(running, without=()) for running in code.RUNNING)
