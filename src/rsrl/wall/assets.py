"""The built page, read into memory when the server starts: no request reaches the file system."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

TYPES: Final[Mapping[str, str]] = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".ico": "image/x-icon",
    ".woff2": "font/woff2",
    ".json": "application/json",
    ".webmanifest": "application/manifest+json",
}

NO_PAGE: Final = b"<!doctype html><title>RSRL</title><p>The page has not been built: see page/ in the source.</p>\n"


class Asset(NamedTuple):
    """A file of the page; `tag` is its ETag."""

    body: bytes
    type: str
    tag: str


def read_assets(folder: Path) -> dict[str, Asset]:
    """Files of a built page by their path in the address, `/` for index.html."""
    found = {}
    for path in sorted(folder.rglob("*")) if folder.is_dir() else []:
        kind = TYPES.get(path.suffix)
        if path.is_file() and kind is not None:
            found["/" + path.relative_to(folder).as_posix()] = _asset(path.read_bytes(), kind)
    found["/"] = found.get("/index.html", _asset(NO_PAGE, TYPES[".html"]))
    return found


def _asset(body: bytes, kind: str) -> Asset:
    return Asset(body, kind, f'"{hashlib.sha256(body).hexdigest()[:16]}"')
