"""Meshes that did not become objects, and why."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from loguru import logger

from pipeline.errors import MeshError
from pipeline.execution.isolated import Lost
from pipeline.geometry.intake import Result
from pipeline.messages.objects import refused_message
from schemas.softgrip.v1.objects_pb2 import RefusedMesh

TRIED_AGAIN = "It is tried again next time; mend it, or take it out of the folder"


@dataclass
class LeftOut:
    """Meshes that did not become objects, as records, and which of them a process was lost to."""

    refused: list[RefusedMesh] = field(default_factory=list)
    cut_short: list[str] = field(default_factory=list)

    def add(self, source: str, why: MeshError | Lost) -> None:
        """Record a mesh that is left out, and tell the reader."""
        if isinstance(why, Lost):
            self.cut_short.append(source)
            why = MeshError(f"{source} {why.how}", TRIED_AGAIN)
        logger.warning("left out: {}", why)
        self.refused.append(refused_message(source, why))

    def sifted(
        self, sources: Iterable[str], results: Iterable[Result | MeshError | Lost]
    ) -> list[Result]:
        """Tell what was made from what was not, and record the latter.

        Parameters
        ----------
        sources
            What was to become something, in order.
        results
            What became of each.

        Returns
        -------
        What was made, in order.
        """
        made = []
        for source, result in zip(sources, results, strict=True):
            if isinstance(result, MeshError | Lost):
                self.add(source, result)
            else:
                made.append(result)
        return made
