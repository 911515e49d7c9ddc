"""The soft vacuum gripper: pad, draping, pressure, wrench, limits, quality.

Pure functions of arrays. The scene under the pad is given as one height for each vertex, along z
of GCS and from any origin, with a mask of the vertices below which the target lies.
"""

from pipeline.gripper.batch import LabelBatch, label, label_batch
from pipeline.gripper.pad import Pad, build_pad, pad_of
from pipeline.gripper.problem import GraspStatus, QpSolution, QualityProblem
from pipeline.gripper.quality import GraspQuality, WeightSummary, label_reference

__all__ = [
    "GraspQuality",
    "GraspStatus",
    "LabelBatch",
    "Pad",
    "QpSolution",
    "QualityProblem",
    "WeightSummary",
    "build_pad",
    "label",
    "label_batch",
    "label_reference",
    "pad_of",
]
