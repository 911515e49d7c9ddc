"""Work items, and what is made of them, as bytes for another process of this run.

Every item of a stage holds the run's configuration. To pack it anew was more than half of what an
item that does nothing costs the driver, and a tenth of what stage grasps' driver spends. So its
bytes are kept, and a worker that gets the same bytes again takes the configuration that it has.

Where the other process has the run's files in another place, paths travel as keys.
"""

import io
import pickle
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pipeline.config import RunConfig

_CONFIGURATIONS = 2  # kept in a worker: the items of a stage hold one
_NONE: Mapping[str, str] = MappingProxyType({})  # no module is called otherwise


class ItemPacker:
    """Packs items that share configurations; one for all items of a stage.

    Parameters
    ----------
    key_of
        Gives the key that a path travels as; None: paths travel as they are.
    """

    def __init__(self, key_of: Callable[[Path], str] | None = None) -> None:
        # By identity: a configuration is kept beside its bytes, so that nothing else takes its id.
        self._kept: dict[int, tuple[RunConfig, bytes]] = {}
        self._pickler = _Pickler if key_of is None else _pickler_with_keys(key_of)

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
        self._pickler(buffer, self).dump(item)
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


def _pickler_with_keys(key_of: Callable[[Path], str]) -> type[_Pickler]:
    """A pickler whose paths are keys; the others are not asked for every value they meet."""

    class Pickler(_Pickler):
        def persistent_id(self, value: Any) -> str | None:
            return key_of(value) if isinstance(value, Path) else None

    return Pickler


def unpack_item(
    data: bytes,
    renamed: Mapping[str, str] = _NONE,
    path_of: Callable[[str], Path] | None = None,
) -> Any:
    """What another process of this run has packed.

    Parameters
    ----------
    data
        Of `ItemPacker.pack`.
    renamed
        Module there → its name here.
    path_of
        Gives the path here of a key; None where no path travels as a key.

    Returns
    -------
    The value.
    """

    class Unpickler(pickle.Unpickler):
        def find_class(self, module_name: str, global_name: str) -> Any:
            return super().find_class(renamed.get(module_name, module_name), global_name)

        def persistent_load(self, key: str) -> Path:
            if path_of is None:
                raise pickle.UnpicklingError("a key, and no folder of a run")
            return path_of(key)

    return Unpickler(io.BytesIO(data)).load()


@lru_cache(maxsize=_CONFIGURATIONS)
def configuration(data: bytes) -> RunConfig:
    """The configuration of these bytes; it is frozen, so that items may share it."""
    config: RunConfig = pickle.loads(data)  # noqa: S301 - our own bytes
    return config
