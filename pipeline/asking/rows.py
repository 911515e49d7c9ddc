"""Artifacts → the columns of `schemas.tables`, part by part; no cloud and no picture is read."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.asking.columns import Part, words
from pipeline.asking.poses import pose_columns
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from schemas.softgrip.v1.objects_pb2 import CatalogueObject, RefusedMesh
from schemas.softgrip.v1.scenes_pb2 import Scene
from schemas.softgrip.v1.training_pb2 import Epoch


def object_rows(path: Path) -> Iterator[Part]:
    """Rows of table objects."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(CatalogueObject)]
    same = ("split", "shape_class", "family", "source", "source_sha256", "unit", "unit_origin")
    numbers = ("scale", "extent_m", "area_m2", "volume_m3", "nsvr", "mass_kg")
    yield {
        "object": words([item.name for item in found]),
        **{name: words([getattr(item, name) for item in found]) for name in same},
        "repairs": words([", ".join(item.repairs) for item in found]),
        **{name: np.array([getattr(item, name) for item in found]) for name in numbers},
        "material": words([item.material for item in found]),
        "faces": np.array([item.mesh.faces.shape[0] for item in found]),
        "convex_parts": np.array([len(item.convex_parts) for item in found]),
        "copies": np.array([len(item.copies) for item in found]),
        "key": words([item.key for item in found]),
    }


def refused_rows(path: Path) -> Iterator[Part]:
    """Rows of table refused."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(RefusedMesh)]
    same = ("source", "reason", "remedy")
    yield {name: words([getattr(item, name) for item in found]) for name in same}


def scene_rows(path: Path) -> Iterator[Part]:
    """Rows of table scenes."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(Scene)]
    same = ("shape_class", "distribution", "split", "renderer", "key")
    yield {
        "scene": words([scene.scene_id for scene in found]),
        **{name: words([getattr(scene, name) for scene in found]) for name in same},
        "level": np.array([scene.level for scene in found]),
        "seed": np.array([scene.seed for scene in found], dtype=np.uint64),
        "objects": np.array([len(scene.objects) for scene in found]),
        "contacts": np.array([len(from_tensor(scene.contacts)) for scene in found]),
        "settle_time_s": np.array([scene.settle_time_s for scene in found]),
        "viewpoints": np.array([len(scene.viewpoints) for scene in found]),
    }


def placed_rows(path: Path) -> Iterator[Part]:
    """Rows of table placed_objects."""
    with open_artifact(path) as artifact:
        found = [
            (scene.scene_id, placed)
            for _, scene in artifact.messages(Scene)
            for placed in scene.objects
        ]
    poses = [from_tensor(placed.world_from_object) for _, placed in found]
    yield {
        "scene": words([scene for scene, _ in found]),
        "object": words([placed.object_name for _, placed in found]),
        "body_id": np.array([placed.body_id for _, placed in found]),
        **pose_columns(np.array(poses)),
        "gap_m": np.array([placed.gap_m for _, placed in found]),
    }


def grasp_rows(path: Path) -> Iterator[Part]:
    """Rows of table grasps."""
    # What labels are takes a second to load, and the stages before them need none of it.
    from pipeline.asking import label_rows

    return label_rows.grasp_rows(path)


def sample_rows(path: Path) -> Iterator[Part]:
    """Rows of table samples."""
    from pipeline.asking import label_rows

    return label_rows.sample_rows(path)


def epoch_rows(path: Path) -> Iterator[Part]:
    """Rows of table epochs."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(Epoch)]
    same = ("epoch", "train_loss", "train_mae", "val_mae", "learning_rate", "samples")
    yield {name: np.array([getattr(epoch, name) for epoch in found]) for name in same}


def attempt_rows(path: Path) -> Iterator[Part]:
    """Rows of table attempts."""
    with open_artifact(path) as artifact:
        found = [_attempt_figures(message) for _, message in artifact.messages(Attempt)]
    texts = ("scene", "policy", "outcome", "cause", "object", "judge")
    names = found[0] if found else {}
    yield {
        name: words([str(row[name]) for row in found])
        if name in texts
        else np.array([row[name] for row in found])
        for name in names
    }


def _attempt_figures(made: Attempt) -> dict[str, str | float]:
    """What a row holds of an attempt; its paths and pictures can go."""
    same = (
        *("level", "policy", "attempt", "outcome", "cause", "candidates", "seal_pressure"),
        *("lifted_height_m", "duration_s", "corrections", "regrasps", "seals", "carried_m_s2"),
        *("borne_n", "weight_n", "judge"),
    )
    return {
        "scene": made.scene_id,
        "object": made.target,
        "predicted_q": made.predicted_quality,
        "reached_q": made.reached_quality,
        **{name: getattr(made, name) for name in same},
    }


ROWS: Mapping[str, Callable[[Path], Iterator[Part]]] = {
    "objects": object_rows,
    "refused": refused_rows,
    "scenes": scene_rows,
    "placed_objects": placed_rows,
    "grasps": grasp_rows,
    "samples": sample_rows,
    "epochs": epoch_rows,
    "attempts": attempt_rows,
}
