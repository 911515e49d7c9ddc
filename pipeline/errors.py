"""The one family of errors a person is meant to read."""


class SoftgripError(Exception):
    """A failure with a cause and a way out, both in one sentence.

    Parameters
    ----------
    what
        The subject and what is wrong with it, naming the file or field.
    remedy
        What the reader can do about it.
    """

    def __init__(self, what: str, remedy: str) -> None:
        self.what = what
        self.remedy = remedy
        super().__init__(f"{what}. {remedy}")

    def __reduce__(self) -> tuple[type["SoftgripError"], tuple[str, str]]:
        """Cross process borders: exceptions pickle their message, not their parts."""
        return type(self), (self.what, self.remedy)


class ConfigError(SoftgripError):
    """A run's configuration cannot be used as it stands."""


class MeshError(SoftgripError):
    """A mesh cannot be turned into an object of the catalogue."""


class ArtifactError(SoftgripError):
    """A file between two stages is missing, damaged or of another version."""


class ContentError(ArtifactError):
    """What a message holds cannot be used; the reader of its file adds the file's name."""

    def __init__(self, what: str, remedy: str = "The file is damaged: make it again") -> None:
        super().__init__(what, remedy)


class PictureError(SoftgripError):
    """A picture, a point cloud or a camera's description from outside cannot be used."""


class PoseError(SoftgripError):
    """A pose that was given is no rigid motion."""


class SceneError(SoftgripError):
    """A clutter scene misses its level's definition."""


class MachineError(SoftgripError):
    """The machine lacks something that a stage needs."""
