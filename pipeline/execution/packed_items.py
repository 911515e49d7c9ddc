"""Work items as bytes for another process of this run; the configuration is packed once.

Every item of a stage holds the run's configuration. To pack it anew was more than half of what an
item that does nothing costs the driver, and a tenth of what stage grasps' driver spends. So its
bytes are kept, and a worker that gets the same bytes again takes the configuration that it has.
"""

import io
import pickle
from functools import lru_cache
from typing import Any

from pipeline.config import RunConfig

_CONFIGURATIONS = 2  # kept in a worker: the items of a stage hold one


class ItemPacker:
    """Packs items that share configurations; one for all items of a stage."""

    def __init__(self) -> None:
        # By identity: a configuration is kept beside its bytes, so that nothing else takes its id.
        self._kept: dict[int, tuple[RunConfig, bytes]] = {}

    def pack(self, item: Any) -> bytes:
        """Pickle an item.

        Parameters
        ----------
        item
            A picklable value.

        Returns
        -------
        The pickle, for `unpack_item`.
        """
        buffer = io.BytesIO()
        _Pickler(buffer, self).dump(item)
        return buffer.getvalue()

    def bytes_of(self, config: RunConfig) -> bytes:
        """The pickle of a configuration, made once."""
        if id(config) not in self._kept:
            self._kept[id(config)] = config, pickle.dumps(config)
        return self._kept[id(config)][1]


class _Pickler(pickle.Pickler):
    def __init__(self, buffer: io.BytesIO, packer: ItemPacker) -> None:
        super().__init__(buffer)
        self._bytes_of = packer.bytes_of

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, RunConfig):
            return configuration, (self._bytes_of(value),)
        return NotImplemented


def unpack_item(data: bytes) -> Any:
    """What `ItemPacker.pack` was given, in another process of this run."""
    return pickle.loads(data)  # noqa: S301 - our own bytes


@lru_cache(maxsize=_CONFIGURATIONS)
def configuration(data: bytes) -> RunConfig:
    """The configuration of these bytes; it is frozen, so that items may share it."""
    config: RunConfig = pickle.loads(data)  # noqa: S301 - our own bytes
    return config
