"""run.toml becomes a tree, or one sentence that names the key."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError, model_validator

from pipeline.config import GraspsConfig, GripperConfig, RunConfig, load_run_config, section_digest
from pipeline.config.section import Section
from pipeline.errors import ConfigError
from tests.refusals import assert_refused_cheaply

RUNS = Path(__file__).resolve().parents[2] / "runs"


def load(tmp_path: Path, text: str) -> RunConfig:
    path = tmp_path / "run.toml"
    path.write_text(text)
    return load_run_config(path)


def test_an_empty_file_is_the_default_tree(tmp_path: Path) -> None:
    assert load(tmp_path, "") == RunConfig()


@pytest.mark.parametrize("path", sorted(RUNS.glob("*/run.toml")), ids=lambda p: p.parent.name)
def test_committed_runs_are_valid(path: Path) -> None:
    assert load_run_config(path).grasps.count > 0


def test_table_one_is_the_default_pad() -> None:
    """Table I of the supplement, in metres and radians."""
    pad = GripperConfig().pad
    assert (pad.seal_radius_m, pad.radius_m, pad.altitude_m) == (0.020, 0.025, 0.030)
    assert pad.rotation_step_rad == pytest.approx(0.141372, abs=1e-6)
    assert (pad.radius_step_m, pad.distance_step_m) == (0.002, 0.002)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[gripper.pad]\nradius=1", r"unknown key 'gripper\.pad\.radius'.*Did you mean 'radius_m'"),
        ("[grasp]\ncount=1", r"unknown key 'grasp'.*Did you mean 'grasps'"),
        ("[train]\nqwxz=1", r"unknown key 'train\.qwxz'.*Known keys: epochs"),
        ("[gripper]\nfriction=-1", r"'gripper\.friction' = -1.*greater than 0"),
        ("[grasps]\ncount='many'", r"'grasps\.count' = 'many'.*integer"),
        ("[scenes]\nlevels=[0, 3]", r"levels go from 1 to 9"),
        ("[grasps]\nportions=2", r"give per_scene"),
        ("[gripper]\nsolver='magic'", r"'gripper\.solver' = 'magic'"),
        ("seed = nan", r"'seed'"),
        ("[gripper", r"is not valid TOML"),
        ("[gripper.pad]\nseal_radius_rg=1.1", r"must not exceed 1"),
        ("[gripper.pad]\naltitude_rg=3.6", r"stem_begins_rg is within gripper\.pad\.altitude_rg"),
        ("[evaluate.hand]\nstem_radius_rg=3.6", r"length_rg must exceed stem_begins_rg"),
        ("[grasps]\nclearance_rg=8", r"grid_height_rg is less than grasps\.clearance_rg"),
        ("[gripper.pad]\nradius_m='0.075'", r"radius_m' = '0.075'"),
        ("[gripper.pad]\nradius_m=1e308", r"radius_m"),
        ("[gripper.pad]\nradius_m=0.01", r"distance_rg puts the camera at 0.36 m"),
        ("[objects]\nmin_extent_m=6", r"min_extent_m must not exceed max_extent_m"),
        ("[evaluate.policy]\ncommit_rg=9", r"commit_rg must be less than standoff_rg"),
        ("[evaluate.policy.motion]\nrefresh_cells=50", r"must not exceed reach_cells"),
        ("[sensing]\nr_g_m=0.03", r"r_g_m follows gripper\.pad\.radius_m"),
        ("[gripper.pad]\ndistance_step_rg=5", r"distance_step_rg must not exceed altitude_rg"),
        ("[gripper.pad]\nradius_step_rg=1e-5", r"a pad of 4\.44e\+06 vertices"),
        ("[evaluate.policy]\ntug_rg=50", r"tug_rg must not exceed lift\.height_rg"),
        (
            "cameras.wrist.near_m=0.3\nevaluate.policy.wrist_view_rg=2.1",
            r"wrist.s camera 0\.28\d* m",
        ),
        ("[network]\nlayers=19", r"'network\.layers' = 19.*even number from 18"),
        ("[train]\nshuffle_window=9\nfurther_runs=['../a']", r"need every sample at once"),
        ("[train]\nshuffle_window=9\nattempts=['a']", r"need every sample at once"),
        ("[objects]\nsolid_kinds=['ball']", r"'objects\.solid_kinds\.0' = 'ball'"),
        ("[objects]\nlimit=2", r"limit must be 0 or at least 3"),
        ("[scenes.clutters_per_level]\nval=0", r"clutters_per_level\.val' = 0"),
        ("[sensing]\ngrid_cells=32", r"grid_side_rg / grid_cells is 0\.075, .* cells of 0\.1"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said) as caught:
        load(tmp_path, text)
    assert str(tmp_path / "run.toml") in str(caught.value)


# By what they nest or count without end; the longer ones cost a reader the square of their length.
HOSTILE = {
    "open_arrays": "seed = " + "[" * 900,
    "arrays": "seed = " + "[" * 30_000 + "]" * 30_000,
    "tables": f"[{'.'.join('a' * 30_000)}]",
    "dotted": f"objects.{'.'.join('a' * 30_000)} = 1",
    "quoted": ".".join(['"a b"'] * 10_000) + " = 1",
    "inline": "seed = " + "{a=" * 10_000 + "1" + "}" * 10_000,
    "digits": "seed = " + "9" * 5_000,
    "hexadecimal": "seed = 0x" + "f" * 30_000,
    "float": "scenes.levels = [1e999999999]",
    "word": "x = " + "a" * 60_000,
    "quotes": "objects = " + '"' * 60_001,
    "zeros": "\0" * 1_000,
    "channels": "network.channels = [1_000_000_000_000, 8, 8, 8]",
}


def test_endless_nesting_and_counts_cost_nothing(tmp_path: Path) -> None:
    hostile = []
    for name, text in HOSTILE.items():
        hostile.append(tmp_path / f"{name}.toml")
        hostile[-1].write_text(text)
    assert_refused_cheaply(load_run_config, sorted(RUNS.glob("*/run.toml")), hostile)


def test_a_long_value_is_told_by_its_beginning(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'seed' = 9{80}…: Input") as caught:
        load(tmp_path, "seed = " + "9" * 2_000)
    assert len(str(caught.value)) < 300


def test_strings_may_hold_many_dots(tmp_path: Path) -> None:
    pattern = ".".join("abc" * 40)
    config = load(tmp_path, f'objects.transparent = ["{pattern}"] # {pattern}x')
    assert config.objects.transparent == (pattern,)


def test_an_absent_run_names_those_there_are(tmp_path: Path) -> None:
    (tmp_path / "ci").mkdir()
    (tmp_path / "ci" / "run.toml").touch()
    with pytest.raises(ConfigError, match=r"does not exist.*ci"):
        load_run_config(tmp_path / "cii" / "run.toml")


def test_the_tree_is_frozen() -> None:
    with pytest.raises(ValidationError):
        RunConfig().seed = 3  # type: ignore[misc]


def test_a_digest_depends_on_values_of_its_sections_alone(tmp_path: Path) -> None:
    plain = load(tmp_path, "")
    spelled = load(tmp_path, f"[train]\nepochs = {RunConfig().train.epochs}")
    other = load(tmp_path, "[train]\nepochs = 3")
    assert section_digest(plain, ("train",)) == section_digest(spelled, ("train",))
    assert section_digest(plain, ("train",)) != section_digest(other, ("train",))
    assert section_digest(plain, ("grasps",)) == section_digest(other, ("grasps",))
    assert section_digest(plain, ("recording.grasps",)) == section_digest(
        other, ("recording.grasps",)
    )


class _Disc(Section):
    radius_m: float = 0.025

    @property
    def area_m2(self) -> float:
        return 3.0 * self.radius_m**2


class _BetterDisc(_Disc):
    @property
    def area_m2(self) -> float:
        return math.pi * self.radius_m**2


class _RoundedDisc(_Disc):
    @model_validator(mode="before")
    @classmethod
    def _rounded(cls, values: dict[str, float]) -> dict[str, float]:
        return {name: round(value, 2) for name, value in values.items()}


class _Discs(Section):
    disc: _Disc


def test_a_digest_follows_what_is_derived_and_what_validators_make() -> None:
    def digest(disc: type[_Disc]) -> str:
        run = RunConfig().model_copy(update={"gripper": _Discs(disc=disc(radius_m=0.0251))})
        return section_digest(run, ("gripper",))

    assert len({digest(disc) for disc in (_Disc, _BetterDisc, _RoundedDisc)}) == 3


@given(st.integers(1, 10_000), st.integers(1, 60), st.integers(0, 500), st.integers(1, 9))
def test_grasps_are_shared_out_or_are_a_scenes(
    count: int, scenes: int, per_scene: int, portions: int
) -> None:
    shared = GraspsConfig(count=count).of_scenes(scenes)
    assert sum(map(sum, shared)) == count
    assert max(shared)[0] - min(shared)[0] <= 1
    if per_scene:
        own = GraspsConfig(count=count, per_scene=per_scene, portions=portions).of_scenes(scenes)
        assert own == [[per_scene] * portions] * scenes


def test_where_no_mesh_is_trained_on_random_solids_must_be() -> None:
    held_out = {"split": {"meshes_in_training": False}}
    with pytest.raises(ValidationError, match="leaves random solids alone for training"):
        RunConfig.model_validate(held_out)
    both = {"random_solids": 9, "embedded_in_training": True}
    with pytest.raises(ValidationError, match="embedded_in_training = false"):
        RunConfig.model_validate(held_out | {"objects": both})
    RunConfig.model_validate(held_out | {"objects": {"random_solids": 9}})
