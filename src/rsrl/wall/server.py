"""The server: a page, one WebSocket, and nothing else."""

import asyncio
import secrets
import socket
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import uvicorn
from fastapi import FastAPI, Request, Response, WebSocket
from starlette.types import ASGIApp

from rsrl.errors import RsrlError
from rsrl.wall.assets import read_assets
from rsrl.wall.messages import ErrorMessage
from rsrl.wall.security import Guard, check_token
from rsrl.wall.session_log import SessionLog
from rsrl.wall.sessions import Session, Sessions
from rsrl.wall.settings import MESSAGE_BYTES, Settings, View
from rsrl.wall.viewer import Viewer


class Wall:
    """The state of a server.

    Attributes:
        sessions: that are watched.
        first: what a viewer sees at first.
        log: of views.
        viewers: connected, by name.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings, self.first = settings, settings.first
        self.sessions, self.log = Sessions(settings), SessionLog(settings.log)
        self.viewers: dict[str, Viewer] = {}

    def welcome(self, viewer: str) -> str:
        """The welcome of a viewer, as JSON."""
        from rsrl.wall.describe import welcome

        return welcome(viewer, self.settings, self.sessions.catalogue).model_dump_json()

    def session_message(self, session: Session, driver: str) -> str:
        """What a viewer watches, as JSON."""
        from rsrl.wall.describe import session_message

        return session_message(session, driver).model_dump_json()

    def drivers(self, session: Session) -> tuple[str, ...]:
        """Codes of the cars of a session."""
        from rsrl.wall.describe import drivers_of

        return drivers_of(session)

    def driver(self, session: Session, asked: str | None) -> str:
        """Code of the driver asked for, by default of the car that the policy drives, or the race's default. Raises RsrlError for none."""
        from rsrl.season import find_car

        record = session.head.record
        if record is not None:
            return record.cars[find_car(record, asked or session.head.driven)].driver
        known = self.drivers(session)
        driver = asked or (known[0] if known else None)
        if driver is None or (known and driver not in known):
            raise RsrlError(f"unknown driver {driver!r}; in the race are {', '.join(known)}")
        return driver

    async def prepare(self) -> None:
        """Open what viewers see at first, so that it moves as soon as the page is there."""
        if self.first is not None:
            try:
                session = await self.sessions.open(self.first)
                session.follow(self.driver(session, self.first.driver))
            except RsrlError:
                pass  # the viewer is told when it comes

    async def list_files(self) -> None:
        """Read the lap files, and tell the viewers that have come meanwhile."""
        threading.Thread(target=self.sessions.catalogue.read, name="wall-files", daemon=True).start()
        while not self.sessions.catalogue.ready.is_set():
            await asyncio.sleep(0.2)
        if self.settings.laps is not None:
            for viewer in self.viewers.values():
                viewer.say(self.welcome(viewer.name))


def create_app(settings: Settings) -> ASGIApp:
    """The application of a server."""
    wall = Wall(settings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        tasks = [asyncio.create_task(wall.prepare()), asyncio.create_task(wall.list_files())]
        yield
        for task in tasks:
            task.cancel()
        wall.sessions.close()

    app = FastAPI(lifespan=lifespan, openapi_url=None, docs_url=None, redoc_url=None)
    assets = read_assets(settings.assets)

    @app.websocket("/ws")
    async def viewer(websocket: WebSocket) -> None:
        await websocket.accept()
        if len(wall.viewers) >= settings.viewers:
            text = f"{settings.viewers} viewers are connected, which is the most"
            await websocket.send_text(ErrorMessage(code="too many", text=text, fatal=True).model_dump_json())
            await websocket.close(1013)
            return
        one = Viewer(secrets.token_hex(4), websocket, wall, shows_first=websocket.query_params.get("first") != "0")
        wall.viewers[one.name] = one
        try:
            await one.run()
        finally:
            del wall.viewers[one.name]

    @app.get("/{path:path}")
    async def page(path: str, request: Request) -> Response:
        asset = assets.get("/" + path)
        if asset is None:
            return Response("not found\n", 404, media_type="text/plain")
        headers = {"etag": asset.tag, "cache-control": "no-cache"}
        if request.headers.get("if-none-match") == asset.tag:
            return Response(status_code=304, headers=headers)
        return Response(asset.body, media_type=asset.type, headers=headers)

    return Guard(app, settings.host, settings.token)


def bind(host: str, port: int) -> socket.socket:
    """A socket that listens on an address. Raises RsrlError where it is taken, or is none of this machine."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(128)
    except (OSError, OverflowError) as error:
        listening.close()
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise RsrlError(f"cannot listen on {host}, port {port}: {reason.lower()}; choose another --port") from None
    return listening


def config(settings: Settings) -> uvicorn.Config:
    """How uvicorn serves. Messages are sent as they are: to deflate each would cost twice the time of sending it."""
    return uvicorn.Config(
        create_app(settings),
        ws_per_message_deflate=False,
        ws_max_size=MESSAGE_BYTES,
        access_log=False,
        log_level="warning",
        server_header=False,
        date_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=1,
        lifespan="on",
    )


def serve(settings: Settings, listening: socket.socket) -> None:
    """Serve on a socket until the process is told to end.

    Raises:
        RsrlError: others can reach the address, and there is no token.
    """
    check_token(settings.host, settings.token)
    uvicorn.Server(config(settings)).run(sockets=[listening])


def resumed(view: View) -> View:
    """A view to go on with, standing still until the viewer starts it."""
    return view._replace(playing=False)
