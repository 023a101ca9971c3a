"""Object stores: buckets of S3 servers, and folders."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import IO, Any, NamedTuple
from urllib.parse import urlsplit
from urllib.request import url2pathname

from groundray.dataset import Error

_PATIENCE_S = 90.0
_RETRIES: Any = {  # of requests that fail by 5xx, a timeout or a lost connection
    "max_retries": 1000,
    "retry_timeout": timedelta(seconds=_PATIENCE_S),
    "backoff": {
        "init_backoff": timedelta(milliseconds=200),
        "max_backoff": timedelta(seconds=10),
        "base": 2,
    },
}
# What the server rejects, or a missing bucket: not worth repeating.
_REJECTED = re.compile(r"NoSuchBucket|status code: [34]\d\d")


class FinalError(Error):
    """Error that another attempt would meet again."""


class Sum(NamedTuple):
    """Size and SHA-256 of an object or file."""

    size: int
    sha256: str


class Object(NamedTuple):
    """Object of a listing."""

    key: str
    time: datetime


def sum_of(data: bytes) -> Sum:
    """Returns the checksum of bytes."""
    return Sum(len(data), hashlib.sha256(data).hexdigest())


class Store:
    """Objects below a URL. Any number of threads may use it."""

    @classmethod
    def begin(cls, url: str) -> Store:
        """Opens a store to write to: a folder is made if there is none."""
        try:
            if folder := _folder(url):
                folder.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            raise Error(f"{url}: {fault.strerror}") from None
        return cls(url)

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        if not re.fullmatch(r"s3://[\w.-]+(/.+)?|file:///.+", self.url):
            raise FinalError(f"{url}: a store is s3://BUCKET/PREFIX or file:///FOLDER")
        if importlib.util.find_spec("obstore") is None:
            raise FinalError("stores need obstore, which is not installed: pip install obstore")
        from obstore.store import from_url

        folder = _folder(self.url)
        if folder and not folder.is_dir():
            raise FinalError(f"{self.url}: there is no such folder; correct the store")
        with self._one_line_errors():
            if folder:
                self._store: Any = from_url(self.url)
            else:
                is_plain = os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")
                options: Any = {"allow_http": is_plain, "timeout": "120s"}
                self._store = from_url(self.url, client_options=options, retry_config=_RETRIES)

    @contextmanager
    def _one_line_errors(self) -> Iterator[None]:
        """Turns exceptions of the client into an Error of one line."""
        from obstore import exceptions

        try:
            yield
        except (FileNotFoundError, exceptions.BaseError, OSError) as fault:
            text = str(fault)
            if isinstance(fault, FileNotFoundError) and "NoSuchBucket" not in text:
                raise
            raise Error(f"{self.url}: {_why(fault, text)}") from None

    def create(self, key: str, data: bytes) -> bool:
        """Writes an object unless there is one; returns false if there is.

        Repeats it after a timeout or a lost connection, after which the client alone does not.
        """
        import obstore
        from obstore.exceptions import AlreadyExistsError, GenericError

        begin_s = time.monotonic()
        while True:
            with self._one_line_errors():
                try:
                    obstore.put(self._store, key, data, mode="create")
                    return True
                except AlreadyExistsError:
                    return False
                except GenericError as fault:
                    is_over = time.monotonic() - begin_s > _PATIENCE_S
                    if is_over or _REJECTED.search(str(fault)):
                        raise
                    time.sleep(1)

    def put_once(self, key: str, data: bytes) -> None:
        """Writes an object, or finds it there with the same bytes.

        Raises FinalError if there are others.
        """
        if not self.create(key, data) and self.sum_of(key) != sum_of(data):
            raise FinalError(
                f"{self.url}/{key}: it has other bytes than this attempt made, although frames are "
                "reproducible: is a machine faulty, or did somebody else write it?"
            )

    def put(self, key: str, data: bytes | IO[bytes]) -> None:
        """Writes an object, instead of any that is there."""
        import obstore

        with self._one_line_errors():
            obstore.put(self._store, key, data)

    def blocks(self, key: str) -> Iterator[bytes]:
        """Reads an object piece by piece. Raises FileNotFoundError if there is none."""
        import obstore

        with self._one_line_errors():
            for block in obstore.get(self._store, key).stream(min_chunk_size=1 << 20):
                yield bytes(block)

    def has(self, key: str) -> bool:
        """Returns true if there is an object."""
        import obstore

        try:
            with self._one_line_errors():
                obstore.head(self._store, key)
            return True
        except FileNotFoundError:
            return False

    def get(self, key: str) -> bytes | None:
        """Reads an object; returns nothing if there is none."""
        try:
            return b"".join(self.blocks(key))
        except FileNotFoundError:
            return None

    def lines(self, key: str) -> Iterator[bytes]:
        """Reads an object line by line, each with its end."""
        rest = b""
        for block in self.blocks(key):
            *whole, rest = (rest + block).split(b"\n")
            yield from (line + b"\n" for line in whole)
        if rest:
            yield rest

    def sum_of(self, key: str) -> Sum | None:
        """Reads an object and returns its checksum, or nothing if there is none."""
        digest, size = hashlib.sha256(), 0
        try:
            for block in self.blocks(key):
                digest.update(block)
                size += len(block)
        except FileNotFoundError:
            return None
        return Sum(size, digest.hexdigest())

    def list(self, prefix: str | None = None) -> Iterator[Object]:
        """Lists all objects, or those below a prefix."""
        import obstore

        with self._one_line_errors():
            for batch in obstore.list(self._store, prefix):
                for each in batch:
                    yield Object(each["path"], each["last_modified"])


def _folder(url: str) -> Path | None:
    """Returns the folder of a URL of a file."""
    return Path(url2pathname(urlsplit(url).path)) if url.startswith("file:///") else None


def _why(fault: Exception, text: str) -> str:
    if "NoSuchBucket" in text:
        return "there is no such bucket; create it, or correct the store"
    if "169.254.169.254" in text:  # where machines of a cloud get their keys
        return "no keys: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"
    if type(fault).__name__ in ("PermissionDeniedError", "UnauthenticatedError"):
        return "no access: check AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and the bucket's rights"
    return text.splitlines()[0].removeprefix("Generic S3 error: ").split(": <?xml")[0]
