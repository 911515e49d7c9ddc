"""What every topic of our files carries: a description and the units, written into the file.

A stranger who opens a file with any MCAP reader finds both in the channel's metadata. Topics with a
name in them (a camera's) are patterns.
"""

from dataclasses import dataclass
from fnmatch import fnmatchcase

DESCRIPTION, UNITS = "description", "units"


@dataclass(frozen=True)
class Channel:
    """What one topic carries.

    Attributes
    ----------
    topic
        The topic, or a pattern of topics.
    schemas
        Names of the messages that it may carry.
    description
        What one message is.
    units
        Units of its numbers, and their frame where they have one.
    """

    topic: str
    schemas: tuple[str, ...]
    description: str
    units: str

    def metadata(self) -> dict[str, str]:
        """The channel's metadata, as MCAP holds it."""
        return {DESCRIPTION: self.description, UNITS: self.units}


SI = "m, kg, s, rad; fields say what differs by the end of their names"
CHANNELS = (
    Channel(
        "/objects",
        ("softgrip.v1.CatalogueObject",),
        "One object of the catalogue: surface, convex parts, class, split, family, mass",
        f"{SI}; object frame, origin at the centre of mass",
    ),
    Channel(
        "/refused",
        ("softgrip.v1.RefusedMesh",),
        "A mesh file that became no object, the reason and the remedy",
        "words",
    ),
    Channel(
        "/scenes",
        ("softgrip.v1.Scene",),
        "One settled clutter: objects at their poses, contacts, cameras",
        f"{SI}; world frame, z up, origin on the table",
    ),
    Channel(
        "/tf",
        ("foxglove.FrameTransforms",),
        "Poses of objects, cameras or pictures in the world",
        "m, unit quaternions",
    ),
    Channel(
        "/scene/*/calibration",
        ("foxglove.CameraCalibration",),
        "Intrinsics of one camera of the scene",
        "pixels; integers lie at the centres of pixels",
    ),
    Channel(
        "/scene/*/colour", ("foxglove.RawImage",), "What the camera sees", "sRGB, 8 bits a colour"
    ),
    Channel(
        "/scene/*/depth",
        ("foxglove.RawImage",),
        "Exact depth along the camera's axis, before a sensor's noise",
        "m; 0 where there is nothing",
    ),
    Channel(
        "/scene/*/behind",
        ("foxglove.RawImage",),
        "Exact depth with transparent objects taken away",
        "m; 0 where there is nothing",
    ),
    Channel(
        "/scene/*/normals",
        ("foxglove.RawImage",),
        "Surface normals in the camera's frame, as colours",
        "128 + 127 n, dimensionless",
    ),
    Channel(
        "/scene/*/segmentation",
        ("foxglove.RawImage",),
        "Which body each pixel shows",
        "body id, 0 is the table",
    ),
    Channel(
        "/grasps",
        ("softgrip.v1.GraspBatch", "softgrip.v1.RankedGrasps"),
        "Grasps: labelled ones of a scene and viewpoint, or ranked ones of a real picture",
        f"{SI}; q, p and GW dimensionless; world frame",
    ),
    Channel(
        "/clouds",
        ("softgrip.v1.CloudBatch",),
        "Clouds around the grasps, or samples, of the message with the same log time",
        "units of r_G, contact frame",
    ),
    Channel(
        "/grasps/poses",
        ("foxglove.PosesInFrame",),
        "Poses of the ranked grasps, best first",
        "m, unit quaternions; frame named in the message",
    ),
    Channel(
        "/pads",
        ("softgrip.v1.DrapedPads",),
        "Pads of some grasps as they lie, with contact pressure",
        "m in GCS; pressure dimensionless",
    ),
    Channel(
        "/index", ("softgrip.v1.ShardIndex",), "Files of a sharded stage, with counts", "counts"
    ),
    Channel(
        "/samples",
        ("softgrip.v1.SampleBatch",),
        "Shuffled training samples: label, object, level; their clouds are on /clouds",
        "q and p dimensionless",
    ),
    Channel(
        "/epochs",
        ("softgrip.v1.Epoch",),
        "One epoch of training: loss and errors",
        "mean |q-hat - q|, dimensionless",
    ),
    Channel(
        "/result",
        ("softgrip.v1.TrainingResult",),
        "The trained network's figures on val and test",
        "mean |q-hat - q|, dimensionless",
    ),
    Channel(
        "/attempts",
        ("softgrip.v1.Attempt",),
        "One attempt of a policy: choice, path, wrench, pictures, outcome",
        f"{SI}; forces N, torques N m in GCS; world frame",
    ),
    Channel(
        "/levels",
        ("softgrip.v1.LevelResult",),
        "Attempts and successes of one policy on one level",
        "counts; shares in [0, 1]; s a pick",
    ),
    Channel(
        "/policies",
        ("softgrip.v1.LevelResult",),
        "Attempts and successes of one policy on all levels",
        "counts; shares in [0, 1]; s a pick",
    ),
    Channel(
        "/comparisons",
        ("softgrip.v1.Comparison",),
        "Two policies compared on the same clutters",
        "shares in [0, 1]; p values",
    ),
    Channel(
        "/imperfection",
        ("softgrip.v1.LevelResult",),
        "Attempts and successes of one policy on all levels, by the scale of the robot's errors",
        "counts; shares in [0, 1]; s a pick; scale dimensionless",
    ),
    Channel(
        "/contacts",
        ("softgrip.v1.ProposedContacts",),
        "Contacts that a policy would propose in one clutter, what rates them, what they are worth",
        "m, rad; distances to edges and clouds in r_G, GCS; q and ratings in [0, 1]; world frame",
    ),
    Channel(
        "/precision",
        ("softgrip.v1.RankedPrecision",),
        "Average precision of one ranking of contacts over the clutters of one split",
        "shares in [0, 1]; counts",
    ),
    Channel(
        "/networks",
        ("softgrip.v1.SweepNetwork",),
        "One network of the family that a study compares",
        "mean |q-hat - q|, dimensionless",
    ),
    Channel(
        "/budget",
        ("softgrip.v1.SweepBudget",),
        "What every network of the study was given",
        "counts",
    ),
)


def channel_of(topic: str) -> Channel | None:
    """What a topic carries; None for a topic that is not one of ours."""
    return next((found for found in CHANNELS if fnmatchcase(topic, found.topic)), None)
