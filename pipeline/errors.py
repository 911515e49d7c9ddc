"""The errors that are reported to the user as one sentence."""


class SoftgripError(Exception):
    """An error with its reason and its remedy.

    Parameters
    ----------
    what
        What is wrong, naming the file or field.
    remedy
        What the user can do about it.
    """

    def __init__(self, what: str, remedy: str) -> None:
        self.what = what
        self.remedy = remedy
        super().__init__(f"{what}. {remedy}")

    def __reduce__(self) -> tuple[type["SoftgripError"], tuple[str, str]]:
        """Pickle both parts, so that the error can be raised again in another process."""
        return type(self), (self.what, self.remedy)


class ConfigError(SoftgripError):
    """The configuration of a run is invalid."""


class MeshError(SoftgripError):
    """A mesh cannot be turned into an object of the catalogue."""


class ArtifactError(SoftgripError):
    """A file that one stage hands to another is missing, damaged or of another version."""


class ContentError(ArtifactError):
    """The content of a message is invalid; the reader of the file adds the file's name."""

    def __init__(self, what: str, remedy: str = "The file is damaged: make it again") -> None:
        super().__init__(what, remedy)


class PictureError(SoftgripError):
    """A picture, point cloud or camera file of the user is invalid."""


class CalibrationError(SoftgripError):
    """What a robot cell's calibration says is missing, impossible, or not good enough."""


class PoseError(SoftgripError):
    """A given pose is not a rigid motion."""


class SceneError(SoftgripError):
    """A clutter scene does not meet the definition of its level."""


class QueryError(SoftgripError):
    """A question about a run cannot be answered."""


class MachineError(SoftgripError):
    """The machine lacks something that a stage needs."""


class StoreError(SoftgripError):
    """The object store in which a run lies cannot be used."""
