"""Strangers stay out: other hosts, other pages, those without the token; and the page may load nothing from elsewhere."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from wall_server import Page, connected, running
from websockets import Origin
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from rsrl.errors import RsrlError
from rsrl.wall import Settings
from rsrl.wall.assets import read_assets
from rsrl.wall.security import COOKIE, POLICY, Guard, check_token, is_loopback
from rsrl.wall.server import bind

TOKEN = "a-token-long-enough-0123"


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    with running(Settings()) as port:
        yield port


@pytest.fixture(scope="module")
def guarded() -> Iterator[int]:
    with running(Settings(token=TOKEN)) as port:
        yield port


def get(port: int, path: str = "/", **headers: str) -> httpx.Response:
    return httpx.get(f"http://127.0.0.1:{port}{path}", headers=headers, trust_env=False)


def test_the_page_may_load_nothing_from_elsewhere(port: int) -> None:
    answer = get(port)
    assert answer.status_code == 200
    assert answer.headers["content-security-policy"] == POLICY
    assert "default-src 'none'" in POLICY
    assert not {"unsafe", "*", "http:", "data:"} & set(POLICY.replace("'", " ").replace("-", " ").split())
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert "server" not in answer.headers


@pytest.mark.parametrize("path", ["/../settings.py", "/%2e%2e/settings.py", "/..%2fschema.json", "//etc/passwd", "/nothing.js", "/ws/"])
def test_no_path_reaches_the_file_system(port: int, path: str) -> None:
    answer = get(port, path)
    assert answer.status_code == 404
    assert answer.headers["content-security-policy"] == POLICY


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "", "127.0.0.1.evil.example", "user@127.0.0.1", "127.0.0.1/x", "[::1"])
def test_another_host_is_refused(port: int, host: str) -> None:
    assert get(port, host=host).status_code in (400, 403)


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "[::1]", "LOCALHOST:1234"])
def test_names_of_this_machine_are_known(port: int, host: str) -> None:
    assert get(port, host=host).status_code == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://", "file://127.0.0.1", None])
def test_another_page_may_not_connect(port: int, origin: str | None) -> None:
    url = f"ws://127.0.0.1:{port}/ws"
    with pytest.raises(InvalidStatus) as refused, connect(url, origin=None if origin is None else Origin(origin), proxy=None):
        pass
    assert refused.value.response.status_code == 403


def test_only_the_page_itself_connects(port: int) -> None:
    with connected(port) as socket:
        assert Page(socket).welcome["viewer"]
    assert get(port, origin="http://evil.example").status_code == 403


def test_without_the_token_nothing_is_shown(guarded: int) -> None:
    assert get(guarded).status_code == 403
    assert get(guarded, "/?token=wrong").status_code == 403
    assert get(guarded, "/other?token=" + TOKEN).status_code == 403
    with pytest.raises(InvalidStatus), connected(guarded):
        pass
    with pytest.raises(InvalidStatus), connected(guarded, cookie=f"{COOKIE}=wrong"):
        pass


def test_the_token_opens_the_page(guarded: int) -> None:
    answer = get(guarded, "/?token=" + TOKEN)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/", "the token does not stay in the address"
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "samesite=strict" in cookie.lower()
    assert get(guarded, cookie=f"{COOKIE}={TOKEN}").status_code == 200
    with connected(guarded, cookie=f"{COOKIE}={TOKEN}") as socket:
        assert Page(socket).welcome["viewer"]


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "::", "example.org"])
def test_another_address_needs_a_token(host: str) -> None:
    assert not is_loopback(host)
    with pytest.raises(RsrlError, match="--token"):
        check_token(host, None)
    check_token(host, TOKEN)


@pytest.mark.parametrize("token", ["", "short", "with a space in it, long", 'quote"quote"quote', "é" * 20, "new\nline-and-more-of-it"])
def test_a_weak_token_is_refused(token: str) -> None:
    with pytest.raises(RsrlError, match="--token"):
        check_token("127.0.0.1", token)


def test_on_another_address_other_names_are_still_strangers() -> None:
    guard = Guard(_nothing, "192.168.1.5", TOKEN)
    known = {host: guard.knows(host) for host in ("192.168.1.5:8044", "localhost", "10.0.0.7", "evil.example")}
    assert known == {"192.168.1.5:8044": True, "localhost": True, "10.0.0.7": True, "evil.example": False}


async def _nothing(scope: object, receive: object, send: object) -> None:
    """An application that is never asked."""


def test_a_port_in_use_is_one_line() -> None:
    first = bind("127.0.0.1", 0)
    try:
        with pytest.raises(RsrlError, match=r"port \d+: .*; choose another --port"):
            bind("127.0.0.1", first.getsockname()[1])
    finally:
        first.close()


def test_the_page_is_read_once(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("<!doctype html>", encoding="utf-8")
    (tmp_path / "wall.js").write_text("1", encoding="utf-8")
    (tmp_path / "notes.txt").write_text("no part of the page", encoding="utf-8")
    found = read_assets(tmp_path)
    assert set(found) == {"/", "/index.html", "/wall.js"}
    assert found["/"].body == b"<!doctype html>"
    assert found["/wall.js"].type.startswith("text/javascript")
    assert b"not been built" in read_assets(tmp_path / "nowhere")["/"].body
