"""Objects are put whole, by whoever is first; a store that fails says what, why and what to do."""

import threading
from collections.abc import Iterator
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from obstore.store import MemoryStore

from pipeline.artifacts.object_store import ObjectStore, TakenError
from pipeline.errors import StoreError

URL = "s3://bucket/runs/ci"


@pytest.fixture
def store() -> ObjectStore:
    return ObjectStore(URL, 1.0, MemoryStore())


def test_files_come_back_as_they_went(store: ObjectStore, tmp_path: Path) -> None:
    for name, content in {"empty": b"", "large": bytes(range(256)) * 2**15}.items():
        (tmp_path / name).write_bytes(content)
        version = store.put(f"a/{name}", tmp_path / name)
        found = store.fetch(f"a/{name}", tmp_path / "back" / name)
        assert (tmp_path / "back" / name).read_bytes() == content
        assert (found.key, found.version, found.size) == (f"a/{name}", version, len(content))
    assert set(store.listed()) == {"a/empty", "a/large"}
    store.remove("a/empty")
    store.remove("a/empty")
    assert store.head("a/empty") is None
    with pytest.raises(FileNotFoundError):
        store.fetch("a/empty", tmp_path / "none")
    assert not list(tmp_path.glob("*none*"))


def test_the_first_writer_counts(store: ObjectStore) -> None:
    first = store.put_if("shard", b"first", None)
    with pytest.raises(TakenError):
        store.put_if("shard", b"second", None)
    second = store.put_if("shard", b"second", first)
    with pytest.raises(TakenError):
        store.put_if("shard", b"third", first)
    store.remove("shard")
    with pytest.raises(TakenError):
        store.put_if("shard", b"third", second)
    assert store.listed() == {}


class Refusing(BaseHTTPRequestHandler):
    """Answers every request as a store does that takes nothing."""

    answer = (500, "InternalError")

    def do_PUT(self) -> None:
        self.rfile.read(int(self.headers.get("content-length", 0)))
        status, code = self.answer
        body = f"<Error><Code>{code}</Code><Message>no</Message></Error>".encode()
        self.send_response(status)
        self.send_header("content-length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *words: object) -> None:
        """Say nothing."""


@pytest.fixture
def refusing(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[Refusing]]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Refusing)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    speak_to(monkeypatch, f"http://127.0.0.1:{server.server_port}")
    yield Refusing
    server.shutdown()
    server.server_close()


def speak_to(monkeypatch: pytest.MonkeyPatch, endpoint: str) -> None:
    for name, value in {
        "AWS_ENDPOINT_URL": endpoint,
        "AWS_ALLOW_HTTP": "true",
        "AWS_ACCESS_KEY_ID": "name",
        "AWS_SECRET_ACCESS_KEY": "word",
        "AWS_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)


@pytest.mark.parametrize(
    ("status", "code", "reason", "remedy"),
    [
        (403, "QuotaExceeded", r"is full \(QuotaExceeded\)", "Free some of it or raise its quota"),
        (507, "XMinioStorageFull", r"is full \(XMinio", "Free some of it or raise its quota"),
        (400, "ExpiredToken", "the credentials have expired", "Renew them, on every node"),
        (403, "AccessDenied", r"do not allow it \(AccessDenied\)", "Allow reading, listing"),
        (404, "NoSuchBucket", "has no such bucket", "Create it"),
        (400, "InvalidArgument", "refuses .InvalidArgument", "Mend this"),
    ],
)
def test_a_store_that_refuses_is_told_in_one_sentence(
    refusing: type[Refusing],
    monkeypatch: pytest.MonkeyPatch,
    status: int,
    code: str,
    reason: str,
    remedy: str,
) -> None:
    monkeypatch.setattr(refusing, "answer", (status, code))
    store = ObjectStore(URL, 0.2)
    for put in (partial(store.put, "a", b"x"), partial(store.put_if, "a", b"x", None)):
        with pytest.raises(StoreError, match=rf"{URL}.*{reason}.*\. {remedy}") as told:
            put()
        assert "run the same command again: what is finished is kept" in str(told.value)
        assert "\n" not in str(told.value)


def test_a_store_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    speak_to(monkeypatch, "http://127.0.0.1:1")  # a port that no program listens on
    with pytest.raises(StoreError, match=rf"{URL} does not answer.*can be reached"):
        ObjectStore(URL, 0.2).head("a")
