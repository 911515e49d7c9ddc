"""The configuration tree of a run, and how run.toml becomes one.

Every number a run depends on is a field here; its digest by section decides
which stages are stale, so nothing that leaves results unchanged (worker
count, log level) belongs in it.
"""

import difflib
import hashlib
import json
import math
import operator
import re
import tomllib
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from pipeline.config.agreement import AgreementConfig
from pipeline.config.cameras import CamerasConfig
from pipeline.config.dataset import DatasetConfig
from pipeline.config.evaluation import EvaluateConfig, RecordingConfig
from pipeline.config.expectations import Expectation
from pipeline.config.folds import FoldsConfig
from pipeline.config.grasps import (
    CELL_SIDE,
    LARGEST_PAD_M,
    SMALLEST_PAD_M,
    GraspsConfig,
    GripperConfig,
    PadConfig,
    SensingConfig,
)
from pipeline.config.holdout import HoldoutConfig
from pipeline.config.learning import (
    LoadingConfig,
    NetworkConfig,
    ShardsConfig,
    SweepConfig,
    TrainConfig,
)
from pipeline.config.objects import ObjectsConfig, SplitConfig
from pipeline.config.predict import PredictConfig
from pipeline.config.referee import RefereeConfig
from pipeline.config.scenes import ScenesConfig
from pipeline.config.section import Section, with_radius
from pipeline.config.store import StoreConfig
from pipeline.errors import ConfigError

# A key a.a.a... costs its reader the square of its parts; strings may hold any number of dots.
_DEEP_KEY = re.compile(r"(?<![^\s.,=\[\]{}#])(?:[^\s.,=\[\]{}#]+[ \t]*\.[ \t]*){32}")
_NO_KEY = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*')  # strings, comments
_LONGEST_SHOWN = 80


# Sections with lengths that are multiples of r_G, by the names that lead to them.
SCALED = (
    ("objects",),
    ("scenes",),
    ("cameras", "static"),
    ("cameras", "wrist"),
    ("sensing",),
    ("grasps",),
    ("evaluate", "lift"),
    ("evaluate", "transport"),
    ("evaluate", "hand"),
    ("evaluate", "policy"),
    ("evaluate", "policy", "motion"),
    ("evaluate", "policy", "unseen"),
    ("evaluate", "policy", "picker"),
)


class RunConfig(Section):
    """All of runs/<run>/run.toml."""

    seed: int = Field(0, ge=0, lt=2**63, description="root of every random stream of the run")
    objects: ObjectsConfig = ObjectsConfig()
    split: SplitConfig = SplitConfig()
    scenes: ScenesConfig = ScenesConfig()
    cameras: CamerasConfig = CamerasConfig()
    gripper: GripperConfig = GripperConfig()
    sensing: SensingConfig = SensingConfig()
    grasps: GraspsConfig = GraspsConfig()
    shards: ShardsConfig = ShardsConfig()
    network: NetworkConfig = NetworkConfig()
    train: TrainConfig = TrainConfig()
    loading: LoadingConfig = LoadingConfig()
    sweep: SweepConfig = SweepConfig()
    referee: RefereeConfig = RefereeConfig()
    agreement: AgreementConfig = AgreementConfig()
    evaluate: EvaluateConfig = EvaluateConfig()
    holdout: HoldoutConfig = HoldoutConfig()
    folds: FoldsConfig = FoldsConfig()
    predict: PredictConfig = PredictConfig()
    recording: RecordingConfig = RecordingConfig()
    dataset: DatasetConfig = DatasetConfig()
    store: StoreConfig = StoreConfig()
    expect: tuple[Expectation, ...] = Field(
        (), description="further expectations, beside those that hold for every run"
    )

    @model_validator(mode="before")
    @classmethod
    def _lengths_follow_the_pad(cls, values: Any) -> Any:
        """Write r_G into every section whose lengths are multiples of it."""
        radius_m = _pad_radius_m(values)
        if radius_m is not None:
            for path in SCALED:
                values = with_radius(values, radius_m, path)
        return values

    @model_validator(mode="after")
    def _stem_is_above_the_pad(self) -> Self:
        if self.evaluate.hand.stem_begins_rg < self.gripper.pad.altitude_rg:
            raise ValueError("evaluate.hand.stem_begins_rg is within gripper.pad.altitude_rg")
        return self

    @model_validator(mode="after")
    def _wrist_sees_what_it_looks_at(self) -> Self:
        hand, camera = self.evaluate.hand, self.cameras.wrist
        above_m = hand.camera_above_m + self.evaluate.policy.wrist_view_m
        away_m = math.hypot(hand.camera_aside_m, above_m)
        if not camera.near_m < away_m < camera.far_m:
            raise ValueError(
                f"evaluate.policy.wrist_view_rg puts the wrist's camera {away_m:g} m from what it "
                f"looks at, and it measures from cameras.wrist.near_m = {camera.near_m:g} to "
                f"far_m = {camera.far_m:g}"
            )
        return self

    @model_validator(mode="after")
    def _something_is_trained_on(self) -> Self:
        if self.split.meshes_in_training:
            return self
        if self.objects.embedded_in_training or not self.objects.random_solids:
            raise ValueError(
                "split.meshes_in_training = false leaves random solids alone for training: set "
                "objects.random_solids to some hundreds, and objects.embedded_in_training = false"
            )
        return self

    @model_validator(mode="after")
    def _clouds_show_what_labels_meet(self) -> Self:
        if self.sensing.grid_height_rg < self.grasps.clearance_rg:
            raise ValueError(
                "sensing.grid_height_rg is less than grasps.clearance_rg: labels would meet "
                "obstacles that no cloud shows"
            )
        return self

    @model_validator(mode="after")
    def _cells_are_as_the_network_reads_them(self) -> Self:
        cell = self.sensing.grid_side_rg / self.sensing.grid_cells
        if not math.isclose(cell, CELL_SIDE, rel_tol=1e-6):
            raise ValueError(
                f"sensing.grid_side_rg / grid_cells is {cell:.4g}, and the network reads cells of "
                f"{CELL_SIDE} r_G"
            )
        return self


def _pad_radius_m(values: Any) -> float | None:
    """r_G of what a run is made of; None where it is none, which pydantic then tells."""
    for name in ("gripper", "pad", "radius_m"):
        if isinstance(values, Section):
            values = getattr(values, name)
        elif isinstance(values, Mapping):
            values = values.get(name, PadConfig().radius_m if name == "radius_m" else {})
        else:
            return None
    fits = isinstance(values, int | float) and SMALLEST_PAD_M <= values <= LARGEST_PAD_M
    return float(values) if fits else None


def load_run_config(path: Path) -> RunConfig:
    """Read and validate a run.toml.

    Parameters
    ----------
    path
        runs/<run>/run.toml.

    Returns
    -------
    The validated tree.

    Raises
    ------
    ConfigError
        The file is absent, is not TOML, or holds a key or value that the tree does not allow; the
        message names the key and the nearest one.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if _DEEP_KEY.search(_NO_KEY.sub("q", text)):
            raise ConfigError(f"{path} holds a key of dozens of parts", "Keys have two or three")
        raw = tomllib.loads(text)
    except FileNotFoundError as error:
        known = sorted(p.parent.name for p in path.parent.parent.glob("*/run.toml"))
        raise ConfigError(
            f"{path} does not exist",
            f"Create it, or choose one of the runs there are: {', '.join(known) or 'none'}",
        ) from error
    except RecursionError as error:
        raise ConfigError(f"{path} nests arrays or tables too deeply", "Mend that line") from error
    except ValueError as error:  # no TOML, no UTF-8, an integer of thousands of digits
        raise ConfigError(f"{path} is not valid TOML: {error}", "Mend that line") from error
    try:
        return RunConfig.model_validate(raw)
    except ValidationError as error:
        raise _explained(path, error) from error


def section_digest(
    config: RunConfig, sections: tuple[str, ...], besides: tuple[str, ...] = ()
) -> str:
    """SHA-256 over the values of some sections, derived ones included, whatever the file's layout.

    Parameters
    ----------
    config
        The tree of a run.
    sections
        Names such as ``"grasps"`` or, for one field of a section, ``"recording.grasps"``.
    besides
        Fields of these sections that do not count, such as ``"grasps.count"``.

    Returns
    -------
    The digest, as 64 hexadecimal digits.
    """
    values = {name: _plain(operator.attrgetter(name)(config)) for name in sections}
    for left_out in besides:
        name, _, field = left_out.rpartition(".")
        del values[name][field]
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """A value as JSON knows it; a section with what it derives from its fields as properties."""
    if isinstance(value, Section):
        return {name: _plain(getattr(value, name)) for name in _value_names(type(value))}
    if isinstance(value, Mapping):
        return {str(name): _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if value is None or isinstance(value, str | int | float):
        return value
    raise TypeError(f"{type(value).__name__} is no value of a configuration")


def _value_names(section: type[Section]) -> list[str]:
    """Fields of a section and its public properties."""
    derived = {
        name
        for cls in section.__mro__
        if issubclass(cls, Section)
        for name, member in vars(cls).items()
        if isinstance(member, property | cached_property) and not name.startswith("_")
    }
    return sorted({*section.model_fields, *section.model_computed_fields, *derived})


def _explained(path: Path, error: ValidationError) -> ConfigError:
    """The first problem of a validation, in words."""
    problem = error.errors()[0]
    location = [str(part) for part in problem["loc"]]
    dotted = ".".join(location) or "the file"
    if problem["type"] == "extra_forbidden":
        known = _field_names(location[:-1])
        near = difflib.get_close_matches(location[-1], known, n=1, cutoff=0.5)
        remedy = f"Did you mean '{near[0]}'?" if near else f"Known keys: {', '.join(known)}"
        return ConfigError(f"{path}: unknown key '{dotted}'", remedy)
    return ConfigError(
        f"{path}: '{dotted}' = {_shown(problem['input'])}: {problem['msg']}", "Change the value"
    )


def _shown(value: object) -> str:
    """A value as Python writes it, or its beginning."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of too many digits, endless nesting
        return "that"
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"


def _field_names(location: list[str]) -> list[str]:
    model: type[Section] = RunConfig
    for part in location:
        annotation = model.model_fields[part].annotation
        if not (isinstance(annotation, type) and issubclass(annotation, Section)):
            return []
        model = annotation
    return list(model.model_fields)
