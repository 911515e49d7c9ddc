"""Which clutters are picked, what rates grasps for each policy, and what contacts come to."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.config import RunConfig, load_run_config
from pipeline.config.evaluation import PolicyName
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.execution.staleness import stage_context
from pipeline.labelling.poses import label_poses
from pipeline.labelling.scene import scene_surfaces
from pipeline.messages.evaluation_results import results_of, without_film
from pipeline.messages.objects import read_objects
from pipeline.messages.samples import read_split
from pipeline.messages.scenes import read_scenes, read_unseen_scenes
from pipeline.messages.trained import rates_for
from pipeline.network.analytic import AnalyticBaseline
from pipeline.network.samples import Samples
from pipeline.network.sources import baseline_from_json
from pipeline.simulation.proposed_contacts import propose_contacts
from schemas.softgrip.v1.evaluation_pb2 import Attempt, ProposedContacts
from stages.evaluate import clutters
from stages.graph import EVALUATE, GIVEN_NETWORK, inputs_of


@pytest.mark.parametrize("split", ["val", "test"])
def test_clutters_are_of_the_split_that_is_asked_for(run: RunFolder, split: str) -> None:
    context = stage_context(EVALUATE, run, inputs_of, None, workers=1)
    wanted = context.config.evaluate.model_copy(update={"split": split})
    config = context.config.model_copy(update={"evaluate": wanted})
    found = clutters(replace(context, config=config), read_unseen_scenes(run.artifact("scenes")))
    assert [scene.split for scene in found] == [split]


def test_the_first_clutters_of_a_level_may_be_left_out(run: RunFolder) -> None:
    context = stage_context(EVALUATE, run, inputs_of, None, workers=1)
    wanted = context.config.evaluate.model_copy(update={"clutters_from": 1})
    config = context.config.model_copy(update={"evaluate": wanted})
    with pytest.raises(ArtifactError, match=r"no test clutter from number 1 on.*at least 2"):
        clutters(replace(context, config=config), read_unseen_scenes(run.artifact("scenes")))


def test_so_many_clutters_of_each_level_are_picked(run: RunFolder) -> None:
    """From the first wanted number on, those that there are."""
    context = stage_context(EVALUATE, run, inputs_of, None, workers=1)
    made = read_unseen_scenes(run.artifact("scenes"))
    one = next(scene for scene in made if scene.split == "test")
    # Of level 1 the clutter of number 0 could not be built.
    numbers = {1: (1, 2, 3), 2: (0, 1, 2), 3: (0,)}
    scenes = [
        replace(one, level=level, scene_id=f"level{level}-test-{number:02d}")
        for level, of_level in numbers.items()
        for number in of_level
    ]
    for most, first, picked in (
        (2, 0, {1: (1, 2), 2: (0, 1), 3: (0,)}),
        (1, 2, {1: (2,), 2: (2,)}),
        (0, 0, numbers),
    ):
        wanted = {"clutters_per_level": most, "clutters_from": first}
        evaluate = context.config.evaluate.model_copy(update=wanted)
        config = context.config.model_copy(update={"evaluate": evaluate})
        found = clutters(replace(context, config=config), scenes)
        assert [scene.scene_id for scene in found] == [
            f"level{level}-test-{number:02d}"
            for level, of_level in picked.items()
            for number in of_level
        ]


@dataclass(frozen=True)
class Rating:
    """What rates grasps in a run: some samples, and the baseline fitted to its train split."""

    run: RunFolder
    config: RunConfig
    samples: Samples
    fitted: AnalyticBaseline

    def by(self, policy: PolicyName, config: RunConfig) -> np.ndarray:
        """The samples as a policy of the run rates them."""
        rate = rates_for(policy, self.run.artifact("train"), config)
        return rate(self.samples.cloud, self.samples.cloud_mask)

    def expected(self) -> np.ndarray:
        return self.fitted.predict(self.samples.cloud, self.samples.cloud_mask)


@pytest.fixture(scope="module")
def rating(run: RunFolder) -> Rating:
    config = stage_context(EVALUATE, run, inputs_of, None, workers=1).config
    samples = read_split(run.artifact("shards"), "test").take(slice(0, 8))
    text = (run.path / "train" / "analytic.json").read_text()
    return Rating(run, config, samples, baseline_from_json(text, config.gripper))


@pytest.mark.parametrize(
    ("policy", "same"),
    [("analytic", True), ("closed-loop", False), ("open-loop", False), ("network", False)],
)
def test_the_analytic_policy_alone_asks_the_baseline_fitted_to_the_train_split(
    rating: Rating, policy: PolicyName, same: bool
) -> None:
    assert np.array_equal(rating.by(policy, rating.config), rating.expected()) is same


def test_the_baseline_may_share_in_the_rating_of_the_closed_loop(rating: Rating) -> None:
    policy = rating.config.evaluate.policy.model_copy(update={"analytic_share": 0.5})
    both = rating.config.evaluate.model_copy(update={"policy": policy})
    joined = rating.config.model_copy(update={"evaluate": both})
    network, analytic = rating.by("network", joined), rating.by("analytic", joined)
    assert np.array_equal(network, rating.by("network", rating.config))
    assert np.array_equal(analytic, rating.expected())
    assert rating.by("closed-loop", joined) == pytest.approx((network + analytic) / 2)


def test_beside_a_given_network_the_released_baseline_stands_in(rating: Rating) -> None:
    """There is no training to fit one to."""
    rate = rates_for("analytic", rating.run.path / GIVEN_NETWORK, rating.config)
    found = rate(rating.samples.cloud, rating.samples.cloud_mask)
    assert not np.array_equal(found, rating.expected())


@pytest.fixture(scope="module")
def contacts(run: RunFolder) -> list[ProposedContacts]:
    with open_artifact(run.artifact("evaluate")) as artifact:
        return [message for _, message in artifact.messages(ProposedContacts)]


def test_contacts_of_seen_and_unseen_families_are_rated(
    run: RunFolder, contacts: list[ProposedContacts]
) -> None:
    assert sorted(message.split for message in contacts) == ["test", "train", "train"]
    figures = json.loads(run.summary("evaluate").read_text())
    for by_ranking in figures["average_precision"].values():
        best, any_order = by_ranking["best order"], by_ranking["any order"]
        assert best["AP"] >= any_order["AP"]
        assert best["AP"] == pytest.approx(
            np.mean([value for name, value in best.items() if name.startswith("AP_")])
        )
    assert "### Ranked contacts" in run.artifact("evaluate").with_suffix(".md").read_text()


def test_contacts_are_worth_what_algorithm_1_says_at_their_poses(
    run: RunFolder, contacts: list[ProposedContacts]
) -> None:
    """Labelled anew, one by one, in the scene that the run made."""
    config = load_run_config(run.config)
    objects = {name: item for name, (item, _) in read_objects(run.artifact("objects")).items()}
    message = next(message for message in contacts if message.split == "test")
    scene = next(s for s in read_scenes(run.artifact("scenes")) if s.scene_id == message.scene_id)
    body_of = {item.object_name: item.body_id for item in scene.objects}
    meshes = {name: item.mesh for name, item in objects.items()}
    surfaces = scene_surfaces(scene, meshes, config.scenes.table_side_m)
    index, quality = from_tensor(message.object_index), from_tensor(message.quality)
    poses = from_tensor(message.world_from_contact).astype(np.float64)
    assert (quality[index < 0] == 0).all()
    for row in np.flatnonzero(index >= 0)[:12]:
        body = np.array([body_of[message.object_names[index[row]]]])
        label = label_poses(
            poses[row][None], body, surfaces, config.gripper, config.grasps.clearance_m
        )
        # Poses are kept in single precision, and a contact at a tolerance's end may go either way.
        assert label.q[0] == pytest.approx(quality[row], abs=0.05)


def test_errors_are_those_of_the_contacts_on_unseen_families(
    run: RunFolder, contacts: list[ProposedContacts]
) -> None:
    own = [message for message in contacts if message.split == "test"]
    quality = np.concatenate([from_tensor(message.quality) for message in own])
    analysis = json.loads(run.summary("evaluate").read_text())["error_analysis"]
    assert analysis["all"]["grasps"] == len(quality)
    for name, error in analysis["all"]["errors"].items():
        if name in own[0].predicted:
            found = np.concatenate([from_tensor(message.predicted[name]) for message in own])
            assert error == pytest.approx(np.abs(found - quality).mean(), abs=1e-6)
    on_objects = sum(row["grasps"] for row in analysis["by_object"].values())
    assert on_objects == sum(int((from_tensor(m.object_index) >= 0).sum()) for m in own)
    message = own[0]
    network = from_tensor(message.predicted["network"])
    wrong = np.abs(network - from_tensor(message.quality))
    worst = from_tensor(message.worst)
    assert wrong[worst] == pytest.approx(np.sort(wrong)[::-1][: len(worst)])
    assert from_tensor(message.worst_cloud).shape == (len(worst), 24, 24, 3)


def test_without_noise_both_predictions_of_the_network_are_one(run: RunFolder) -> None:
    config = load_run_config(run.config)
    exact = config.model_copy(
        update={"sensing": config.sensing.model_copy(update={"disturbed": False})}
    )
    meshes = {name: one.mesh for name, (one, _) in read_objects(run.artifact("objects")).items()}
    scene = next(iter(read_scenes(run.artifact("scenes"))))
    # In the network's place, for one of two epochs says the same of every cloud.
    analytic = rates_for("analytic", run.artifact("train"), config)
    for chosen, same in ((exact, True), (config, False)):
        rng = np.random.default_rng(0)
        found = propose_contacts(scene, meshes, analytic, analytic, chosen, rng)
        seen, without = (found.predicted[name] for name in ("network", "network, without noise"))
        assert np.array_equal(seen, without) is same


def test_jobs_carry_no_pictures_and_figures_need_no_film(run: RunFolder) -> None:
    """What a cluster is sent and what the driver holds stay small, and nothing else changes."""
    for unseen, scene in zip(
        read_unseen_scenes(run.artifact("scenes")), read_scenes(run.artifact("scenes")), strict=True
    ):
        assert scene.views
        assert unseen.views == ()
        for name in vars(replace(scene, views=())):
            if name not in ("views", "objects"):
                np.testing.assert_array_equal(getattr(unseen, name), getattr(scene, name))
    with open_artifact(run.artifact("evaluate")) as artifact:
        whole = [message for _, message in artifact.messages(Attempt)]
        bare = without_film(message for _, message in artifact.messages(Attempt))
    policies = load_run_config(run.config).evaluate.policies
    scenes = read_unseen_scenes(run.artifact("scenes"))
    told = [results_of(scenes, policies, made, (1.0, 3.0)).summary() for made in (whole, bare)]
    assert told[0] == told[1]
    assert sum(m.ByteSize() for m in bare) < sum(m.ByteSize() for m in whole) / 10
