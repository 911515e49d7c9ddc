"""What all configuration sections share: frozen, bounded, no unknown keys; lengths by r_G."""

from typing import Any, Protocol, overload

from pydantic import BaseModel, ConfigDict, Field

PICOMETRE_DIGITS = 12  # so that 6 r_G of 25 mm are 0.15 m to the last bit of a float


class KnowsRadius(Protocol):
    """A section that knows the pad's radius."""

    @property
    def r_g_m(self) -> float:
        """r_G [m]."""


class LengthInMetres:
    """A length in metres whose field is a multiple of the pad's radius r_G.

    In a section, ``look_m = LengthInMetres()`` reads the field ``look_rg``.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._field = name.removesuffix("_m") + "_rg"

    @overload
    def __get__(self, section: None, owner: type) -> "LengthInMetres": ...
    @overload
    def __get__(self, section: KnowsRadius, owner: type) -> float: ...
    def __get__(self, section: KnowsRadius | None, owner: type) -> "float | LengthInMetres":
        if section is None:
            return self
        multiple: float = getattr(section, self._field)
        return round(multiple * section.r_g_m, PICOMETRE_DIGITS)


class Section(BaseModel):
    """One table of run.toml. Every field states unit, bound and source."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, ignored_types=(LengthInMetres,)
    )


class ScaledSection(Section):
    """A section with lengths that grow with the gripper: fields in r_G, attributes in metres.

    What a person configures ends in ``_rg`` and is a multiple of the pad's radius; what the
    program reads ends in ``_m`` and is metres.
    """

    r_g_m: float = Field(
        0.025, gt=0, description="r_G of the run's pad: gripper.pad.radius_m, never set here [m]"
    )


def with_radius(values: Any, radius_m: float, path: tuple[str, ...]) -> Any:
    """The values of a run with r_G written into one of its scaled sections.

    Parameters
    ----------
    values
        What a `RunConfig` is made of: nested mappings, or sections.
    radius_m
        r_G of the run's pad [m].
    path
        Names of the tables that lead to the section.

    Returns
    -------
    The same values, with r_G in the named section.

    Raises
    ------
    ValueError
        The section names another radius itself.
    """
    if isinstance(values, Section):
        if not path:
            return values.model_copy(update={"r_g_m": radius_m})
        inner = with_radius(getattr(values, path[0]), radius_m, path[1:])
        return values.model_copy(update={path[0]: inner})
    if not isinstance(values, dict):
        return values  # pydantic says what is wrong with it
    if path:
        return {**values, path[0]: with_radius(values.get(path[0], {}), radius_m, path[1:])}
    if values.get("r_g_m", radius_m) != radius_m:
        raise ValueError("r_g_m follows gripper.pad.radius_m and is not set by itself")
    return {**values, "r_g_m": radius_m}
