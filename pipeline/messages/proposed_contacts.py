"""Proposed contacts ↔ softgrip.v1.ProposedContacts; what they come to: precision and errors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from google.protobuf.message import Message
from jaxtyping import Float

from pipeline.artifacts.tensors import from_tensor, to_tensor
from pipeline.config.evaluation import PrecisionConfig
from pipeline.control.average_precision import (
    AveragePrecision,
    average_precision,
    mean_over_scenes,
)
from pipeline.network.error_analysis import Predictions, error_analysis
from pipeline.simulation.proposed_contacts import (
    ANALYTIC,
    NETWORK,
    SEAL_RATIO,
    WITHOUT_NOISE,
    ProposedContacts,
)
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1 import evaluation_pb2


@dataclass(frozen=True)
class Proposed:
    """What the proposed contacts of all scenes come to.

    Attributes
    ----------
    contacts
        Contacts of all scenes.
    precisions
        Of each ranking in each split, the best first.
    errors
        The split that is evaluated and `error_analysis` of it; None where it has no contact.
    """

    contacts: Sequence[evaluation_pb2.ProposedContacts]
    precisions: list[evaluation_pb2.RankedPrecision]
    errors: dict[str, Any] | None

    def topics(self) -> dict[str, Sequence[Message]]:
        """The messages of evaluate's artifact by their topics."""
        return {"/contacts": self.contacts, "/precision": self.precisions}

    def summary(self) -> dict[str, Any]:
        """The figures by the names that evaluate's summary gives them; none without contacts."""
        if not self.precisions:
            return {}
        by_split: dict[str, dict[str, Any]] = {}
        for found in self.precisions:
            by_split.setdefault(found.split, {})[found.ranking] = {
                "AP": found.average_precision,
                **{f"AP_{name}": value for name, value in sorted(found.by_threshold.items())},
                "scenes": found.scenes,
                "judged": found.judged,
            }
        return {"average_precision": by_split, "error_analysis": self.errors}


@dataclass(frozen=True, eq=False)
class WorstContact:
    """A contact that the network errs on.

    Attributes
    ----------
    scene_id
        The clutter.
    quality
        q.
    predicted
        q-hat.
    predicted_without_noise
        q-hat from the pictures without the sensors' noise.
    cloud
        As measured, in units of r_G, shape (g, g, 3); NaN where nothing was.
    cloud_without_noise
        The same without the sensors' noise.
    """

    scene_id: str
    quality: float
    predicted: float
    predicted_without_noise: float
    cloud: Float[np.ndarray, "g g 3"]
    cloud_without_noise: Float[np.ndarray, "g g 3"]


def worst_by_object(
    messages: Sequence[evaluation_pb2.ProposedContacts], split: str, each: int
) -> dict[str, list[WorstContact]]:
    """The worst contacts on each object of a split.

    Parameters
    ----------
    messages
        Contacts of all scenes.
    split
        The split.
    each
        How many of each object, at most.

    Returns
    -------
    Object → its contacts, that with the largest error first.
    """
    found: dict[str, list[WorstContact]] = {}
    for message in messages:
        if message.split != split:
            continue
        quality, index = from_tensor(message.quality), from_tensor(message.object_index)
        network, exact = (from_tensor(message.predicted[n]) for n in (NETWORK, WITHOUT_NOISE))
        clouds = from_tensor(message.worst_cloud), from_tensor(message.worst_cloud_without_noise)
        for row, contact in enumerate(from_tensor(message.worst).tolist()):
            if index[contact] >= 0:
                worst = WorstContact(
                    message.scene_id,
                    float(quality[contact]),
                    float(network[contact]),
                    float(exact[contact]),
                    clouds[0][row].astype(np.float32),
                    clouds[1][row].astype(np.float32),
                )
                found.setdefault(message.object_names[index[contact]], []).append(worst)
    return {
        name: sorted(own, key=lambda one: -abs(one.predicted - one.quality))[:each]
        for name, own in found.items()
    }


def contacts_message(
    scene: ClutterScene, found: ProposedContacts
) -> evaluation_pb2.ProposedContacts:
    """The message of a scene's contacts."""
    names = tuple(sorted({item.object_name for item in scene.objects}))
    index_of = {item.body_id: names.index(item.object_name) for item in scene.objects}
    index = np.array([index_of.get(int(body), -1) for body in found.body_id], dtype=np.int16)

    def single(array: np.ndarray) -> Any:
        return to_tensor(np.asarray(array, dtype=np.float32))

    return evaluation_pb2.ProposedContacts(
        scene_id=scene.scene_id,
        level=scene.level,
        split=scene.split,
        object_names=names,
        world_from_contact=single(found.world_from_contact),
        object_index=to_tensor(index),
        quality=single(found.quality),
        tilt_rad=single(found.tilt_rad),
        edge_rg=single(found.edge_rg),
        value={name: single(value) for name, value in found.value.items()},
        predicted={name: single(value) for name, value in found.predicted.items()},
        worst=to_tensor(found.worst.astype(np.int32)),
        worst_cloud=to_tensor(found.worst_cloud.astype(np.float16)),
        worst_cloud_without_noise=to_tensor(found.worst_cloud_without_noise.astype(np.float16)),
    )


def proposed_of(
    messages: Sequence[evaluation_pb2.ProposedContacts],
    shape_class: Mapping[str, str],
    config: PrecisionConfig,
    evaluated: str,
) -> Proposed:
    """Precision of each ranking by split, and errors on the evaluated split.

    Parameters
    ----------
    messages
        Contacts of all scenes.
    shape_class
        Class of each object by its name.
    config
        How precision is taken.
    evaluated
        The split whose errors are analysed.

    Returns
    -------
    The figures.
    """
    precisions = [
        precision
        for split in sorted({message.split for message in messages}, key=lambda s: s != evaluated)
        for precision in _precisions(
            [message for message in messages if message.split == split], config
        )
    ]
    own = [m for m in messages if m.split == evaluated and m.quality.shape[0]]
    if not own:
        return Proposed(messages, precisions, None)
    errors = error_analysis(_predictions(own, shape_class))
    return Proposed(messages, precisions, {"split": evaluated, **errors})


def _precisions(
    messages: Sequence[evaluation_pb2.ProposedContacts], config: PrecisionConfig
) -> list[evaluation_pb2.RankedPrecision]:
    """Of each ranking over scenes of one split, the best first."""
    rows = []
    for ranking in sorted(messages[0].value):
        mean = mean_over_scenes([_precision(message, ranking, config) for message in messages])
        rows.append(
            evaluation_pb2.RankedPrecision(
                ranking=ranking,
                split=messages[0].split,
                scenes=len(messages),
                average_precision=mean.mean,
                by_threshold={f"{s:g}": value for s, value in mean.by_threshold.items()},
                judged=mean.judged,
            )
        )
    return sorted(rows, key=lambda row: -row.average_precision)


def _precision(
    message: evaluation_pb2.ProposedContacts, ranking: str, config: PrecisionConfig
) -> AveragePrecision:
    return average_precision(
        from_tensor(message.world_from_contact)[:, :3, 3].astype(np.float64),
        from_tensor(message.object_index).astype(np.int64),
        from_tensor(message.value[ranking]).astype(np.float64),
        from_tensor(message.quality).astype(np.float64),
        config,
    )


def _predictions(
    messages: Sequence[evaluation_pb2.ProposedContacts], shape_class: Mapping[str, str]
) -> Predictions:
    """All contacts together, with the names and classes of their objects."""
    names: list[str] = []
    for message in messages:
        # -1, on no object, takes the last: the empty name.
        known = [*message.object_names, ""]
        names += [known[index] for index in from_tensor(message.object_index).tolist()]

    def joined(field: str) -> np.ndarray:
        return np.concatenate([from_tensor(getattr(message, field)) for message in messages])

    predicted = {
        name: np.concatenate([from_tensor(message.predicted[name]) for message in messages])
        for name in (NETWORK, WITHOUT_NOISE, ANALYTIC, SEAL_RATIO)
    }
    return Predictions(
        quality=joined("quality").astype(np.float64),
        seal_ratio=predicted.pop(SEAL_RATIO),
        predicted=predicted,
        object_name=np.array(names),
        shape_class=np.array([shape_class.get(name, "") for name in names]),
        tilt_rad=joined("tilt_rad"),
        edge_rg=joined("edge_rg"),
    )
