"""A network learns from others beside the labels: what they say, and no more than it is told to."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config.learning import NetworkConfig
from pipeline.errors import ArtifactError
from pipeline.network.canonical import network_input
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.figures import mean_absolute_error
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.inference import predict
from pipeline.network.input_channels import CHANNELS_0_1, SYMMETRIES
from pipeline.network.samples import GraspTensors
from pipeline.network.teachers import Teachers, teaching_network, training_loss
from pipeline.network.training import train
from tests.network.conftest import TAUGHT as NETWORK
from tests.network.conftest import TEACHING as CONFIG
from tests.network.conftest import ignored
from tests.network.planes import planes_with_holes

CPU = torch.device("cpu")


@pytest.fixture
def teacher(taught_planes: GaCnn) -> GaCnn:
    return taught_planes


def predicted(network: GaCnn, samples: GraspTensors) -> np.ndarray:
    return predict(network, samples.cloud, samples.mask, 64, 1, average_symmetries=False)


@pytest.mark.parametrize(("share", "follows_the_teacher"), [(1.0, True), (0.0, False)])
def test_a_student_follows_teacher_or_labels_as_the_share_says(
    teacher: GaCnn, known: GraspTensors, tmp_path: Path, share: float, follows_the_teacher: bool
) -> None:
    """Its labels are of a world in which what was good is bad."""
    samples = planes_with_holes(600, seed=3)
    contrary = replace(samples, quality=1 - samples.quality)
    config = CONFIG.model_copy(update={"teacher_share": share})
    student = train(
        *(config, NETWORK, 2, contrary, known, tmp_path, ignored), teachers=[teacher]
    ).network
    told = predicted(student, known)
    from_teacher = mean_absolute_error(told, predicted(teacher, known))
    from_labels = mean_absolute_error(told, 1 - np.asarray(known.quality))
    assert (from_teacher < from_labels - 0.1) == follows_the_teacher


def test_a_student_of_another_size_learns_from_several(known: GraspTensors, tmp_path: Path) -> None:
    """Teachers need not be of the student's depth or width, and stay what they are."""
    teachers = [build_network(NETWORK, 5), build_network(NetworkConfig(layers=24), 6)]
    before = [save_checkpoint_bytes(each) for each in teachers]
    once = CONFIG.model_copy(update={"epochs": 1})
    train(once, NETWORK, 2, known, known, tmp_path, ignored, teachers=teachers)
    assert [save_checkpoint_bytes(each) for each in teachers] == before


def test_teachers_say_the_mean_of_what_each_says(known: GraspTensors) -> None:
    networks = [build_network(NETWORK, seed) for seed in (3, 4)]
    inputs = network_input(torch.from_numpy(known.cloud[:40]), torch.from_numpy(known.mask[:40]))
    each = [predicted(network, known)[:40] for network in networks]
    as_it_lies = torch.zeros(2, dtype=torch.long)
    said = Teachers(networks, CONFIG, CPU).mean_prediction(inputs, as_it_lies).numpy()
    assert said == pytest.approx(np.mean(each, axis=0), abs=1e-6)
    assert said != pytest.approx(each[0], abs=1e-6)


def test_asked_in_all_turns_teachers_say_what_is_predicted_averaged(
    teacher: GaCnn, known: GraspTensors
) -> None:
    """Each of the two goes through the eight turns in an order of its own."""
    cloud, mask = known.cloud[:40], known.mask[:40]
    inputs = network_input(torch.from_numpy(cloud), torch.from_numpy(mask))
    teachers, turns = Teachers([teacher, teacher], CONFIG, CPU), torch.arange(SYMMETRIES)
    asked = torch.stack((turns, turns.roll(3)), dim=1)
    said = [teachers.mean_prediction(inputs, each).numpy() for each in asked]
    averaged = predict(teacher, cloud, mask, 64, 1, average_symmetries=True)
    assert np.mean(said, axis=0) == pytest.approx(averaged, abs=1e-5)
    assert said[0] != pytest.approx(averaged, abs=1e-5)


def test_teachers_are_asked_in_turns_of_their_own_and_so_after_a_kill(
    teacher: GaCnn, known: GraspTensors, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    once, asked = CONFIG.model_copy(update={"epochs": 1, "batch_size": 8}), []
    say = Teachers.mean_prediction

    def heard(self: Teachers, inputs: torch.Tensor, turns: torch.Tensor) -> torch.Tensor:
        asked.append(tuple(turns.tolist()))
        if len(asked) == kill_at:
            raise KeyboardInterrupt
        return say(self, inputs, turns)

    def trained(folder: str) -> bytes:
        found = train(
            *(once, NETWORK, 1, known, known, tmp_path / folder, ignored),
            save_every_s=0.0,
            teachers=[teacher, teacher],
        )
        return save_checkpoint_bytes(found.network)

    monkeypatch.setattr(Teachers, "mean_prediction", heard)
    kill_at = 0
    whole = trained("whole")
    straight = list(asked)
    assert all({turn[at] for turn in straight} == set(range(SYMMETRIES)) for at in (0, 1))
    assert any(first != second for first, second in straight)
    asked.clear()
    kill_at = 12
    with pytest.raises(KeyboardInterrupt):
        trained("killed")
    kill_at = 0
    assert trained("killed") == whole
    assert asked[:11] + asked[12:] == straight


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0, 1))
def test_the_loss_lies_between_that_of_the_label_and_that_of_the_teachers(
    seed: int, share: float
) -> None:
    predicted, quality, taught = torch.rand(3, 16, generator=torch.Generator().manual_seed(seed))
    config = CONFIG.model_copy(update={"teacher_share": share})
    loss = float(training_loss(predicted, quality, taught, config))
    ends = [float(training_loss(predicted, wanted, None, config)) for wanted in (quality, taught)]
    assert loss == pytest.approx((1 - share) * ends[0] + share * ends[1], rel=1e-5)
    assert ends[0] == pytest.approx(
        float((predicted - quality).abs().sum()), abs=16 * CONFIG.loss_beta
    )


def test_a_state_of_other_teachers_is_not_continued(
    teacher: GaCnn, known: GraspTensors, tmp_path: Path
) -> None:
    config = CONFIG.model_copy(update={"epochs": 1})

    def trained(teachers: list[GaCnn], folder: str) -> bytes:
        state = tmp_path / folder
        found = train(config, NETWORK, 1, known, known, state, ignored, teachers=teachers)
        return save_checkpoint_bytes(found.network)

    alone = trained([], "a")
    after_another = trained([teacher], "a")
    assert after_another == trained([teacher], "b")
    assert after_another != alone


def test_what_is_no_network_of_this_program_is_told() -> None:
    with pytest.raises(ArtifactError, match=r"^mine: "):
        teaching_network(b"nothing", "mine")
    old = save_checkpoint_bytes(build_network(NETWORK, 0, CHANNELS_0_1))
    with pytest.raises(ArtifactError, match="mine takes the input channels x, y"):
        teaching_network(old, "mine")
