"""Objects under the URL of an object store: put whole or not at all, and told apart by version.

Credentials, region and endpoint come from the environment, as the store's own tools take them
(AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN, AWS_REGION, AWS_ENDPOINT_URL).
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from types import ModuleType
from typing import Any

from pipeline.artifacts.publishing import published
from pipeline.errors import MachineError, StoreError

# S3 and what speaks its protocol say these where nothing more can be put.
FULL = {
    *("QuotaExceeded", "InsufficientStorage", "StorageFull", "InsufficientCapacity"),
    *("XMinioStorageFull", "XMinioAdminBucketQuotaExceeded"),
}
FULL_STATUS = 507  # HTTP: insufficient storage
EXPIRED = {"ExpiredToken", "ExpiredTokenException", "RequestExpired", "TokenRefreshRequired"}
FORBIDDEN_STATUS = (401, 403)  # HTTP: not authenticated, not allowed
INSTANCE = "169.254."  # where a cloud's machine asks for its role, when no credentials are set
MOST_RETRIES = 2**31 - 1  # no bound but the time: what counts is how long a store is away
GO_ON = "run the same command again: what is finished is kept"

_CODE = re.compile(r"<Code>(\w+)</Code>")
_STATUS = re.compile(r"status code: (\d{3})")


@dataclass(frozen=True)
class StoredObject:
    """What a store knows of an object.

    Attributes
    ----------
    key
        Its name below the store's URL.
    version
        Its ETag: another one wherever its content is another.
    size
        In bytes.
    modified
        When it was put, by the store's clock.
    """

    key: str
    version: str
    size: int
    modified: datetime


class TakenError(Exception):
    """Another writer has put the object meanwhile."""


class ObjectStore:
    """The objects below a URL.

    Parameters
    ----------
    url
        Store and prefix.
    patience_s
        How long a request is tried again [s].
    transport
        The package's own store that carries requests; None: what the URL's scheme needs.
    """

    def __init__(self, url: str, patience_s: float, transport: Any = None) -> None:
        self.url = url.rstrip("/")
        self._library = _library()
        with self._told():
            self._transport: Any = transport or self._library.store.from_url(
                self.url,
                retry_config={
                    "max_retries": MOST_RETRIES,
                    "retry_timeout": timedelta(seconds=patience_s),
                },
            )

    def head(self, key: str) -> StoredObject | None:
        """What is known of an object; None where there is none."""
        with self._told():
            try:
                return _stored(self._library.head(self._transport, key))
            except FileNotFoundError:
                return None

    def listed(self) -> dict[str, StoredObject]:
        """Every object below the URL, by key."""
        with self._told():
            try:
                found = [one for some in self._library.list(self._transport) for one in some]
            except FileNotFoundError as error:
                raise self._no_bucket() from error
        return {one["path"]: _stored(one) for one in found}

    def fetch(self, key: str, path: Path) -> StoredObject:
        """Write an object to a file, whole or not at all; what was written.

        Parameters
        ----------
        key
            Its name.
        path
            The file.

        Returns
        -------
        What the store knows of it.

        Raises
        ------
        FileNotFoundError
            There is none.
        StoreError
            The store cannot be used.
        """
        with self._told():
            answer = self._library.get(self._transport, key)
        with self._told(), published(path) as scratch:
            with scratch.open("wb") as file:
                for block in answer.stream():
                    file.write(block)
            found = _stored(answer.meta)
            if (size := scratch.stat().st_size) != found.size:
                raise OSError(f"{key} has {found.size} bytes, and {size} came")
        return found

    def read(self, key: str) -> bytes:
        """The content of a small object. Raises FileNotFoundError where there is none."""
        with self._told():
            return bytes(self._library.get(self._transport, key).bytes())

    def put(self, key: str, content: Path | bytes) -> str:
        """Put an object in the place of whatever stands there; its version."""
        with self._told():
            try:
                made = self._library.put(self._transport, key, content)
            except FileNotFoundError as error:
                raise self._no_bucket() from error
        return str(made["e_tag"])

    def put_if(self, key: str, content: Path | bytes, instead_of: str | None) -> str:
        """Put an object if nobody else has done so.

        Parameters
        ----------
        key
            Its name.
        content
            A file, or bytes.
        instead_of
            Version that must stand there now; None: nothing may.

        Returns
        -------
        Its version.

        Raises
        ------
        TakenError
            Something else stands there.
        StoreError
            The store cannot be used.
        """
        mode = "create" if instead_of is None else {"e_tag": instead_of}
        refusals = self._library.exceptions
        with self._told():
            try:
                made = self._library.put(self._transport, key, content, mode=mode)
            except (refusals.AlreadyExistsError, refusals.PreconditionError) as error:
                raise TakenError(key) from error
            except FileNotFoundError as error:
                if instead_of is not None:
                    raise TakenError(key) from error  # it has been removed
                raise self._no_bucket() from error
        return str(made["e_tag"])

    def remove(self, key: str) -> None:
        """Remove an object; where there is none, nothing happens."""
        with self._told():
            try:
                self._library.delete(self._transport, key)
            except FileNotFoundError:
                return

    @contextmanager
    def _told(self) -> Iterator[None]:
        """A failure of the store as one sentence that names it."""
        try:
            yield
        except self._library.exceptions.BaseError as error:
            raise store_error(self.url, str(error)) from error

    def _no_bucket(self) -> StoreError:
        return StoreError(f"{self.url} has no such bucket", f"Create it, then {GO_ON}")


def store_error(url: str, said: str) -> StoreError:
    """The error for a store that cannot be used.

    Parameters
    ----------
    url
        The store.
    said
        What the library said: the request, the status, and the answer of the store.

    Returns
    -------
    The error, with the store, the reason and the remedy.
    """
    found_code, found_status = _CODE.search(said), _STATUS.search(said)
    code = found_code[1] if found_code else ""
    status = int(found_status[1]) if found_status else 0
    reason = code or (f"HTTP {status}" if status else "")
    if INSTANCE in said:
        return StoreError(
            f"{url} cannot be used: there are no credentials for it",
            f"Set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, then {GO_ON}",
        )
    if code in FULL or status == FULL_STATUS:
        return StoreError(
            f"{url} is full ({reason})", f"Free some of it or raise its quota, then {GO_ON}"
        )
    if code in EXPIRED:
        return StoreError(
            f"{url} cannot be used: the credentials have expired ({reason})",
            f"Renew them, on every node, then {GO_ON}",
        )
    if status in FORBIDDEN_STATUS:
        return StoreError(
            f"{url} cannot be used: the credentials do not allow it ({reason})",
            f"Allow reading, listing, writing and deleting below it, then {GO_ON}",
        )
    if not status:
        first = said.strip().splitlines()[0] if said.strip() else "no reason given"
        return StoreError(
            f"{url} does not answer ({first})", f"See that it can be reached, then {GO_ON}"
        )
    first = said.strip().splitlines()[0]
    return StoreError(f"{url} refuses ({reason}: {first})", f"Mend this, then {GO_ON}")


def _stored(meta: Any) -> StoredObject:
    return StoredObject(meta["path"], str(meta["e_tag"]), meta["size"], meta["last_modified"])


def _library() -> ModuleType:
    """The package that speaks to object stores: an optional one."""
    try:
        import obstore
    except ImportError as error:
        raise MachineError(
            "A run in an object store needs the package obstore", "pip install 'softgrip[store]'"
        ) from error
    return obstore
