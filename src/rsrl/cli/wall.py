"""`rsrl wall`: the pit wall, a page that shows a race, the policy's call and its reasons."""

import sys
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.options import JsonOption, SeedOption
from rsrl.cli.output import Output
from rsrl.cli.replay_options import DriverOption, SeasonFromOption
from rsrl.errors import RsrlError
from rsrl.standard_error import tell

if TYPE_CHECKING:
    from rsrl.wall.feeds import FeedSource

RaceOption = Annotated[
    str | None,
    typer.Option("--race", metavar="RACE", help="The race simulated at first (bahrain-2023), or that of --source where it does not say."),
]
SourceOption = Annotated[
    str | None, typer.Option("--source", metavar="SOURCE", help="A real race: f1 (live timing), game (UDP), a recording, or - for a pipe.")
]
FollowOption = Annotated[bool, typer.Option("--follow", help="With --source FILE: the recording is still being written; watch it live.")]
LapsOption = Annotated[
    Path | None,
    typer.Option("--laps", metavar="FOLDER", help="Folder of lap files such as laps_2023.csv.gz, whose races can then be replayed."),
]
ModelOption = Annotated[
    str, typer.Option("--model", metavar="MODEL", help="The policy: a shipped one such as all, a run folder, model.zip or module:function.")
]
HostOption = Annotated[
    str, typer.Option("--host", metavar="ADDRESS", help="Address to listen on. Any but this machine's own needs a token.")
]
PortOption = Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port to listen on; 0 for any that is free.")]
TokenOption = Annotated[
    str | None, typer.Option("--token", metavar="TEXT", help="What others must know to open the page; at least 16 characters.")
]
BrowserOption = Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Go on with what was watched last, after the server has ended.")]
DEFAULT_RACE = "bahrain-2023"
PORT = 8044


def command(
    race: RaceOption = None,
    driver: DriverOption = None,
    source: SourceOption = None,
    follow: FollowOption = False,
    season_from: SeasonFromOption = None,
    seed: SeedOption = 0,
    laps: LapsOption = None,
    model: ModelOption = "all",
    host: HostOption = "127.0.0.1",
    port: PortOption = PORT,
    token: TokenOption = None,
    browser: BrowserOption = True,
    resume: ResumeOption = False,
    json: JsonOption = False,
) -> None:
    """Open the pit wall: a page with the race, the call, and why.

    The race is simulated, real as --source tells it, or replayed from a lap
    file of --laps; the policy calls the car you choose, lap by lap. With
    --source the page is there once the source has told of its cars. A
    recording has a clock of your own, a live race that of the race. Ctrl-C
    ends the server.

    [bold]Examples[/bold]

    rsrl wall
    rsrl wall --race monza-2023 --driver SAI --seed 3
    rsrl wall --laps data/laps
    rsrl wall --source f1 --driver HAM
    rsrl wall --source monza.jsonl --race monza-2025
    """
    from rsrl.wall.security import check_token

    check_token(host, token)
    if source is not None and resume:
        raise RsrlError("give either --source or --resume")
    if source is None:
        _refuse_without_source(follow, season_from)
        race = _known_race(race or DEFAULT_RACE, driver)
    if laps is not None and not laps.is_dir():
        raise RsrlError(f"--laps {laps}: no such folder")
    _check_model(model)

    from rsrl.wall.server import bind, resumed, serve
    from rsrl.wall.session_log import last_view, log_file
    from rsrl.wall.settings import Settings, View

    log = log_file(port)
    listening = bind(host, port)
    try:
        feed = None if source is None else _feed(source, race, driver, season_from, follow)
        first = feed.view if feed else resumed(last_view(log)) if resume else View("simulated", str(race), driver, seed)
    except BaseException:
        listening.close()
        raise
    port = int(listening.getsockname()[1])
    _tell_address(Output(json), host, port, token, browser)
    live = (feed.live,) if feed else ()
    serve(Settings(model=model, laps=laps, host=host, port=port, token=token, first=first, log=log, live=live), listening)


def _known_race(race: str, driver: str | None) -> str:
    """Name of the race that is simulated. Raises RsrlError where there is no such race, or driver in it."""
    from rsrl.season import find_car, load_race

    record = load_race(race)
    find_car(record, driver)
    return record.name


def _tell_address(output: Output, host: str, port: int, token: str | None, browser: bool) -> None:
    from rsrl.wall.security import is_loopback

    name = "localhost" if is_loopback(host) else host
    address = f"http://{f'[{host}]' if ':' in host else name}:{port}/" + (f"?token={token}" if token else "")
    output.result({"address": address, "host": host, "port": port}, f"The pit wall is at {address} (Ctrl-C ends it)")
    sys.stdout.flush()  # whoever reads it through a pipe wants it now, not when the server ends
    if browser:
        webbrowser.open(address)


def _refuse_without_source(follow: bool, season_from: str | None) -> None:
    for option, given in (("--follow", follow), ("--season-from", season_from is not None)):
        if given:
            raise RsrlError(f"{option} goes with --source")


def _feed(source: str, race: str | None, driver: str | None, season_from: str | None, follow: bool) -> "FeedSource":
    """The source, once it has told of its cars. Raises RsrlError as `rsrl live` does."""
    tell("rsrl: waiting for the cars of the race ...")
    from rsrl.replay import Asked
    from rsrl.wall.feeds import feed_source

    feed = feed_source(source, Asked(race, driver, season_from), follow=follow, tell=lambda line: tell(f"rsrl: {line}"))
    if feed.note:
        tell(f"rsrl: {feed.note}")
    return feed


def _check_model(model: str) -> None:
    """Raise RsrlError for a policy that there is not; the shipped ones are known without importing what runs them."""
    if model != "all":
        from rsrl.explanation import load_any_policy

        load_any_policy(model)
