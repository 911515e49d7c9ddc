"""The S3 server of moto, started from an environment of its own (`make s3`)."""

import re
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parent / ".venv" / "bin" / "moto_server"
BUCKET = "bucket"


@contextmanager
def s3_server() -> Iterator[dict[str, str]]:
    """A server with one bucket; the environment in which it is found."""
    if not PROGRAM.is_file():
        pytest.skip("the S3 server is not installed: run 'make s3'")
    server = subprocess.Popen(
        [PROGRAM, "-H", "127.0.0.1", "-p", "0"], stderr=subprocess.PIPE, text=True
    )
    try:
        assert server.stderr is not None
        said = (re.search(r"Running on http://127\.0\.0\.1:(\d+)", line) for line in server.stderr)
        port = next(int(found[1]) for found in said if found)
        threading.Thread(target=server.stderr.read, daemon=True).start()  # its pipe stays empty
        connection = HTTPConnection("127.0.0.1", port)
        connection.request("PUT", f"/{BUCKET}")
        assert connection.getresponse().status == 200
        connection.close()
        yield {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
            "AWS_ALLOW_HTTP": "true",
            "AWS_ACCESS_KEY_ID": "name",
            "AWS_SECRET_ACCESS_KEY": "word",
            "AWS_REGION": "us-east-1",
        }
    finally:
        server.kill()
        server.wait()
