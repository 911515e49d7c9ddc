"""Who makes a run that lies in an object store: one driver at a time, on whichever machine.

The driver puts an object where none is, and renews it as long as it lives; each of both happens
only if nobody else has put it meanwhile. A driver that is not heard of for the length of a lease,
by the store's own clock, is taken for dead, and another may go on.
"""

import json
import os
import socket
import threading
import time
from dataclasses import dataclass
from datetime import datetime
from types import TracebackType
from typing import Self

from loguru import logger

from pipeline.artifacts.object_store import ObjectStore, TakenError
from pipeline.artifacts.publishing import has_ended, this_process
from pipeline.errors import StoreError

LEASE = ".driver.json"
CLOCK = ".clock"  # put to read the store's clock
RENEWALS = 3  # in the length of a lease: two may fail


@dataclass(frozen=True)
class Holder:
    """Who holds, or held, a run.

    Attributes
    ----------
    name
        Host, process and stage, in words.
    process
        As `pipeline.artifacts.publishing.this_process` names it.
    renewed
        How often.
    released
        Whether it is done.
    """

    name: str
    process: str
    renewed: int = 0
    released: bool = False

    def to_json(self) -> bytes:
        """As the store keeps it."""
        return json.dumps(vars(self), sort_keys=True).encode()


class Lease:
    """The right to make a run, held while the context lasts.

    Parameters
    ----------
    store
        The run's objects.
    stage
        What is made.
    lease_s
        How long a driver may be silent [s].
    """

    def __init__(self, store: ObjectStore, stage: str, lease_s: float) -> None:
        self._store, self._lease_s = store, lease_s
        name = f"process {os.getpid()} on {socket.gethostname()} (stage {stage})"
        self._mine = Holder(name, this_process())
        self._version = ""
        self._lost: StoreError | None = None
        self._done = threading.Event()
        self._renewing = threading.Thread(target=self._renew, daemon=True)

    def __enter__(self) -> Self:
        self._version = self._taken()
        self._renewing.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._done.set()
        self._renewing.join()
        if self._lost is None:
            try:
                self._put(released=True)
            except (StoreError, TakenError) as problem:
                logger.warning("the run's store keeps this process as its driver: {}", problem)

    def check(self) -> None:
        """Raise StoreError where another driver has taken the run."""
        if self._lost is not None:
            raise self._lost

    def _taken(self) -> str:
        """Take the run, from nobody or from one who is done or dead; the lease's version."""
        try:
            held = self._store.head(LEASE)
            if held is None:
                return self._put_mine(None)
            holder = holder_of(self._store)
            silent_s = (self._now() - held.modified).total_seconds()
            if holder and not holder.released and not has_ended(holder.process):
                if silent_s < self._lease_s:
                    raise self._in_use(holder, silent_s)
                logger.warning("{} is silent for {:.0f} s: going on here", holder.name, silent_s)
            return self._put_mine(held.version)
        except TakenError as error:
            raise self._in_use(holder_of(self._store), 0.0) from error

    def _in_use(self, holder: Holder | None, silent_s: float) -> StoreError:
        return StoreError(
            f"{self._store.url} is in use by {holder.name if holder else 'another process'}",
            "Wait until it is done, or stop it; where it was killed, run the same command again "
            f"in {max(1.0, self._lease_s - silent_s):.0f} s",
        )

    def _now(self) -> datetime:
        self._store.put(CLOCK, b"")
        found = self._store.head(CLOCK)
        if found is None:
            raise StoreError(f"{self._store.url} loses what is put there", "Use another store")
        return found.modified

    def _put(self, released: bool) -> None:
        mine = self._mine
        self._mine = Holder(mine.name, mine.process, mine.renewed + 1, released)
        self._version = self._put_mine(self._version)

    def _put_mine(self, instead_of: str | None) -> str:
        """Put what this process says, if nobody else has put anything; the lease's version."""
        try:
            return self._store.put_if(LEASE, self._mine.to_json(), instead_of)
        except TakenError:
            # An answer that was lost is asked for again, and then the first one stands there.
            found = self._store.head(LEASE)
            if found is None or holder_of(self._store) != self._mine:
                raise
            return found.version

    def _renew(self) -> None:
        """Renew until the context ends; the whole life of the thread."""
        heard = time.monotonic()
        while not self._done.wait(self._lease_s / RENEWALS):
            try:
                self._put(released=False)
                heard = time.monotonic()
            except TakenError:
                self._lost = self._in_use(holder_of(self._store), 0.0)
                return
            except StoreError as error:
                if time.monotonic() - heard > self._lease_s:
                    self._lost = error
                    return


def holder_of(store: ObjectStore) -> Holder | None:
    """Who holds a run, or held it last; None where that cannot be read."""
    try:
        return Holder(**json.loads(store.read(LEASE)))
    except (FileNotFoundError, ValueError, TypeError):
        return None
