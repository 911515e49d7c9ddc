"""Cross-validation: a network for each fold, and the errors of all folds together."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.network.by_object import ObjectError, errors_by_object, interval_of_mean
from pipeline.network.figures import mean_absolute_error
from pipeline.network.fitted_baselines import baseline_errors, fit_baselines
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict
from pipeline.network.samples import Samples, join_samples
from pipeline.network.training import train
from pipeline.network.training_figures import EpochMetrics

BEGUN = "objects that can be gripped, labels balanced over q, by the network they began with"
ARRAYS = ("quality", "single", "averaged")
Part = tuple[Sequence[str], Samples]  # names that a fold's samples point into, and the samples


@dataclass(frozen=True, eq=False)
class TestedFold:
    """What a network says of the fold that it did not see.

    Attributes
    ----------
    errors
        Of each object.
    quality
        q of the n test samples, shape (n,).
    single
        q̂ of one prediction a grasp, shape (n,).
    averaged
        q̂ averaged over the symmetries, shape (n,).
    facts
        Numbers of samples, kept epoch and errors of the fold, with those of the baselines; and
        ``begun``, the error on each object of the network that training began with.
    """

    __test__ = False  # not a test case, whatever its name

    errors: list[ObjectError]
    quality: Float[np.ndarray, " n"]
    single: Float[np.ndarray, " n"]
    averaged: Float[np.ndarray, " n"]
    facts: dict[str, Any]

    def to_json(self) -> str:
        """All of it as text."""
        arrays = {name: getattr(self, name).tolist() for name in ARRAYS}
        errors = [asdict(one) for one in self.errors]
        return json.dumps({"errors": errors, **arrays, "facts": self.facts})

    @classmethod
    def from_json(cls, text: str) -> "TestedFold":
        """Read back what `to_json` wrote."""
        found = json.loads(text)
        arrays = {name: np.array(found[name], dtype=np.float32) for name in ARRAYS}
        return cls([ObjectError(**one) for one in found["errors"]], **arrays, facts=found["facts"])


def train_and_test(
    config: RunConfig,
    parts: Sequence[Part],
    fold: int,
    tested: Collection[str],
    state_dir: Path,
    on_epoch: Callable[[EpochMetrics], None],
    start: GaCnn | None = None,
) -> TestedFold:
    """Train on all folds but this and the next, measure epochs on the next, predict this one.

    With ``folds.trained = false`` the network that is given predicts this one as it is.

    Parameters
    ----------
    config
        Sections network, train, folds and gripper, and the seed.
    parts
        Every fold, at least three.
    fold
        The one that is tested.
    tested
        Names of the objects that are tested on.
    state_dir
        Folder of the resume state.
    on_epoch
        Called after each epoch.
    start
        A network that saw nothing of any fold, to begin with; None: weights drawn from the seed.

    Returns
    -------
    Errors and predictions on the fold.

    Raises
    ------
    ArtifactError
        The fold has no grasp of an object that is tested on.
    """
    names, samples = parts[fold]
    chooses = (fold + 1) % len(parts)
    train_set = join_samples(
        [part for k, (_, part) in enumerate(parts) if k not in (fold, chooses)]
    )
    facts: dict[str, Any] = {"train": 0, "val": 0, "kept_epoch": None, "val_mae": None}
    begun_with, network = None, start
    if config.folds.trained:
        val_set = parts[chooses][1]
        trained = train(
            config.train,
            config.network,
            config.seed,
            train_set.tensors,
            val_set.tensors,
            state_dir,
            on_epoch,
            show_progress=True,
            start=start,
        )
        facts = {"train": len(train_set), "val": len(val_set)}
        facts |= {"kept_epoch": trained.kept_epoch, "val_mae": trained.val_mae}
        begun_with, network = start, trained.network
    assert network is not None  # config: what is not trained is given
    of_tested = np.isin(np.array(names)[samples.object_index], sorted(tested))
    samples = samples.take(np.flatnonzero(of_tested))
    quality, weight = samples.quality, samples.proposal_weight

    def predicted(network: GaCnn, averaging: bool) -> Float[np.ndarray, " n"]:
        return predict(
            *(network, samples.cloud, samples.cloud_mask),
            *(config.train.batch_size, config.train.threads, averaging),
        )

    def errors(
        single: Float[np.ndarray, " n"], averaged: Float[np.ndarray, " n"]
    ) -> list[ObjectError]:
        return errors_by_object(names, samples.object_index, quality, single, averaged, weight)

    single, averaged = (predicted(network, averaging) for averaging in (False, True))
    begun = predicted(begun_with, averaging=False) if begun_with else None
    fitted = fit_baselines(train_set, config.gripper, config.train.baseline_samples)
    baselines = baseline_errors(fitted, samples)
    return TestedFold(
        errors=errors(single, averaged),
        quality=quality,
        single=single,
        averaged=averaged,
        facts=facts
        | {
            "test": len(samples),
            "mae_single": mean_absolute_error(single, quality),
            "baselines": baselines.balanced,
            "baselines_as_proposed": baselines.as_proposed,
            "begun": {} if begun is None else {e.name: e.mae for e in errors(begun, begun)},
        },
    )


def figures_of_folds(
    done: Sequence[TestedFold],
    families: Mapping[str, str],
    resamples: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """The headline over all folds, by fold and by object.

    Parameters
    ----------
    done
        Every fold, tested.
    families
        Family of each object.
    resamples
        Bootstrap samples over objects.
    rng
        Draws them.

    Returns
    -------
    Figures by the names that the summary gives them.
    """
    errors = [(fold, one) for fold, found in enumerate(done) for one in found.errors]
    quality = np.concatenate([found.quality for found in done])
    single = np.concatenate([found.single for found in done])
    averaged = np.concatenate([found.averaged for found in done])
    macro = {
        f"{whose}, {how}": _mean([one for _, one in errors if taken(one)], value, resamples, rng)
        for whose, taken in (
            ("objects that can be gripped", lambda one: one.graspable),
            ("all objects", lambda one: True),
        )
        for how, value in (
            ("labels balanced over q", lambda one: one.mae),
            ("grasps as proposed", lambda one: one.mae_as_proposed),
        )
    }
    begun = {name: mae for found in done for name, mae in found.facts["begun"].items()}
    if begun:
        gripped = [one for _, one in errors if one.graspable]
        macro[BEGUN] = _mean(gripped, lambda one: begun[one.name], resamples, rng)
    return {
        "folds": len(done),
        "objects": len(errors),
        "families": len({families[one.name] for _, one in errors}),
        "grasps": len(quality),
        "mae": mean_absolute_error(averaged, quality),
        "mae_single": mean_absolute_error(single, quality),
        "baselines": {
            name: sum(found.facts["test"] * found.facts["baselines"][name] for found in done)
            / len(quality)
            for name in done[0].facts["baselines"]
        },
        "macro": macro,
        "by_object": {
            one.name: {"fold": fold, **one.figures(), "mae_begun": begun.get(one.name)}
            for fold, one in errors
        },
        "by_fold": {str(fold): found.facts for fold, found in enumerate(done)},
    }


def _mean(
    errors: Sequence[ObjectError],
    value: Callable[[ObjectError], float | None],
    resamples: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Mean of one error an object, over those that have it, with its interval."""
    values = [found for one in errors if (found := value(one)) is not None]
    return {
        "objects": len(values),
        "mae": float(np.mean(values)) if values else None,
        "interval_95": interval_of_mean(values, resamples, rng),
    }
