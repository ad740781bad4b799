"""`rsrl live`: a race followed as it comes: state, call, confidence and health, whenever one of them changes."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rsrl.cli.files import check_file
from rsrl.cli.options import ForceOption, JsonOption
from rsrl.cli.output import Output
from rsrl.cli.replay_options import DriverOption, ModelOption, SeasonFromOption
from rsrl.standard_error import tell

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rsrl.live import Moment

SourceOption = Annotated[
    str, typer.Option("--source", metavar="SOURCE", help="f1 (live timing), game (UDP), a recording that grows, or - for a pipe.")
]
RaceOption = Annotated[
    str | None, typer.Option("--race", metavar="RACE", help="The race, such as bahrain-2023, where the source does not say.")
]
LogOption = Annotated[
    Path | None, typer.Option("--log", metavar="FILE", help="Write every event, state and call as JSON lines; rsrl replay reads them.")
]
RecordOption = Annotated[
    Path | None, typer.Option("--record", metavar="FILE", help="With f1: record the feed too, as rsrl record f1 does.")
]
PortOption = Annotated[int | None, typer.Option("--port", metavar="N", min=1, max=65535, help="With game: the UDP port. Default: 20777.")]
UrlOption = Annotated[str | None, typer.Option("--url", metavar="URL", help="With f1: another address of the feed, for tests.")]
SilentOption = Annotated[float | None, typer.Option("--until-silent", metavar="S", min=0.1, help="End after so many seconds of silence.")]


def command(
    source: SourceOption,
    driver: DriverOption = None,
    race: RaceOption = None,
    model: ModelOption = None,
    season_from: SeasonFromOption = None,
    log: LogOption = None,
    record: RecordOption = None,
    port: PortOption = None,
    url: UrlOption = None,
    until_silent: SilentOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Follow a race as it comes, and call one car of it.

    The view changes with every event. The race is called anew on every lap
    of the car, whenever the track status changes or a rival boxes, and last
    as the car comes to the pit entry. A source may be joined late. Once it
    has told of no car for eight seconds it is stale, and nothing is called
    until it is heard of again.

    With --json each look at the race is a line of JSON. Ctrl-C ends.

    [bold]Examples[/bold]

    rsrl live --source f1 --driver HAM --log monza.log
    rsrl live --source game --driver HAM
    rsrl live --source monza.jsonl --driver VER --race monza-2025
    rsrl live --source - --driver NOR --json
    """
    if log is not None:
        check_file(log, force, "--log")
    tell("rsrl: preparing the calls ...")
    from rsrl.explanation import load_any_policy
    from rsrl.feeds.anomalies import Anomalies
    from rsrl.live import LiveOptions, follow_live
    from rsrl.replay import Asked

    policy = load_any_policy(model or "all")
    anomalies = Anomalies()
    options = LiveOptions(port, url, record, tell=lambda line: tell(f"rsrl: {line}"))
    asked = Asked(race, driver, season_from)
    moments = follow_live(source, asked, policy, options=options, anomalies=anomalies, log=log, until_silent_s=until_silent)
    last = _shown(moments, json)
    if last is None:
        tell("rsrl: nothing came")
    elif not json:
        from rsrl.cli.live_view import closing_lines

        for line in closing_lines(last, anomalies, log):
            Output(as_json=False).result({}, line)


def _shown(moments: "Iterator[Moment]", as_json: bool) -> "Moment | None":
    """Show a race while it lasts; its last moment, or None where nothing came. Ctrl-C ends it as a session's end does."""
    import msgspec

    from rsrl.cli.live_view import LiveView, look_line

    last = None
    try:
        if not as_json and sys.stdout.isatty():
            with LiveView() as view:
                for last in moments:
                    view.show(last)
            return last
        for last in moments:
            for look in last.looks:
                print(msgspec.json.encode(look).decode() if as_json else look_line(look), flush=True)
    except KeyboardInterrupt:
        pass
    return last
