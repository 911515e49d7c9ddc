"""Algorithm 1 of the supplement: proposes grasps and labels them.

`label_mesh` labels grasps of one mesh at given poses. `label_scene` proposes grasps on a scene,
labels them, and cuts the clouds that the cameras measured around them.
"""

from pipeline.gripper import GraspStatus, LabelBatch
from pipeline.labelling.mesh import label_mesh, load_mesh
from pipeline.labelling.scene import label_scene, scene_surfaces

__all__ = [
    "GraspStatus",
    "LabelBatch",
    "label_mesh",
    "label_scene",
    "load_mesh",
    "scene_surfaces",
]
