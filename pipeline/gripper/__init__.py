"""The soft vacuum gripper: pad, draping, pressure, wrench, limits, quality.

Pure functions of arrays: what the scene looks like under the pad comes in as a height a
vertex, along z of GCS and from any origin, with a mask of what lies on the target.
"""

from pipeline.gripper.batch import LabelBatch, label, label_batch
from pipeline.gripper.pad import Pad, build_pad
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
]
