"""`rsrl wall`: the pit wall, a page that shows a race, the policy's call and its reasons."""

import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from rsrl.cli.options import JsonOption, SeedOption
from rsrl.cli.output import Output
from rsrl.errors import RsrlError

RaceOption = Annotated[
    str,
    typer.Option("--race", metavar="RACE", help="The race that is simulated at first, such as bahrain-2023; the page can choose another."),
]
DriverOption = Annotated[
    str | None,
    typer.Option("--driver", metavar="NAME", help="The driver whose car is called: HAM, 44, hamilton. Default: the race's default driver."),
]
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
    race: RaceOption = DEFAULT_RACE,
    driver: DriverOption = None,
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

    The race is simulated, or replayed from a lap file of --laps; the policy
    calls the car you choose, lap by lap. Ctrl-C ends the server.

    [bold]Examples[/bold]

    rsrl wall
    rsrl wall --race monza-2023 --driver SAI --seed 3
    rsrl wall --laps data/laps
    """
    from rsrl.season import find_car, load_race
    from rsrl.wall.security import check_token, is_loopback

    check_token(host, token)
    record = load_race(race)
    find_car(record, driver)
    if laps is not None and not laps.is_dir():
        raise RsrlError(f"--laps {laps}: no such folder")
    _check_model(model)

    from rsrl.wall.server import bind, resumed, serve
    from rsrl.wall.session_log import last_view, log_file
    from rsrl.wall.settings import Settings, View

    log = log_file(port)
    first = resumed(last_view(log)) if resume else View("simulated", record.name, driver, seed)
    listening = bind(host, port)
    port = int(listening.getsockname()[1])
    name = "localhost" if is_loopback(host) else host
    address = f"http://{f'[{host}]' if ':' in host else name}:{port}/" + (f"?token={token}" if token else "")
    Output(json).result({"address": address, "host": host, "port": port}, f"The pit wall is at {address} (Ctrl-C ends it)")
    sys.stdout.flush()  # whoever reads it through a pipe wants it now, not when the server ends
    if browser:
        webbrowser.open(address)
    serve(Settings(model=model, laps=laps, host=host, port=port, token=token, first=first, log=log), listening)


def _check_model(model: str) -> None:
    """Raise RsrlError for a policy that there is not; the shipped ones are known without importing what runs them."""
    if model != "all":
        from rsrl.explanation import load_any_policy

        load_any_policy(model)
