"""The released network's files: where they lie and what they are called. Imports nothing large."""

from pipeline.artifacts.named_inputs import RELEASED as RELEASED
from pipeline.artifacts.named_inputs import RELEASED_CHECKPOINT

RELEASED_FOLDER = RELEASED_CHECKPOINT.parent
EXPORT_FILE = "ga_cnn.onnx"  # what control runs
CHECKPOINT_FILE = RELEASED_CHECKPOINT.name  # what a training begins with
TEST_GRASPS_FILE = "test_grasps.safetensors"  # some of its own test grasps
TRAIN_GRASPS_FILE = "train_grasps.safetensors"  # some of those that it was trained on
BASELINE_FILE, FIGURES_FILE, DIGESTS_FILE = "analytic.json", "figures.json", "digests.json"
