"""`rsrl record`: live timing or a game's packets to a file, and a game's recording played back."""

import asyncio
from collections.abc import Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from rsrl.cli.files import check_file
from rsrl.cli.options import ForceOption, JsonOption
from rsrl.cli.output import Output
from rsrl.standard_error import tell

if TYPE_CHECKING:
    from rsrl.feeds.anomalies import Anomalies

ABOUT: Final = """Record live timing, or what a Formula One game sends.

f1 records the live timing of Formula One without a login, game the packets
of the games of 2023 to 2026. play sends a recording of a game again. A
recording ends with the session, or with Ctrl-C.

[bold]Examples[/bold]

rsrl record f1 monza.jsonl
rsrl record game race.packets
rsrl record play race.packets --speed 10
rsrl record game race.packets --until-silent 60 --json
"""

app = typer.Typer(help=ABOUT)

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="The recording to write.")]
PortOption = Annotated[
    int | None, typer.Option("--port", metavar="N", min=1, max=65535, help="UDP port, as set in the game. Default: the games' own, 20777.")
]


@app.command("f1", short_help="Record Formula One's live timing")
def f1(
    file: FileArgument,
    url: Annotated[str | None, typer.Option("--url", metavar="URL", help="Another address of the feed, for tests.")] = None,
    json: JsonOption = False,
) -> None:
    """Record Formula One's live timing, without a login.

    One line a message, until the session ends or Ctrl-C. A lost connection
    is made again, and a recording that exists is continued. Other programs
    may read the file while it grows.

    [bold]Examples[/bold]

    rsrl record f1 monza.jsonl
    rsrl record f1 monza.jsonl --json
    """
    from rsrl.feeds.live_timing.recorder import Recorder
    from rsrl.feeds.live_timing.signalr import URL

    recorder = Recorder(file, lambda line: tell(f"rsrl: {line}"), url or URL)
    _until_interrupted(recorder.run())
    times = f"{recorder.connections} connection{'' if recorder.connections == 1 else 's'}"
    end = "the session is over" if recorder.over else "the session goes on"
    result = {"path": str(file), "messages": recorder.lines, "connections": recorder.connections, "session_over": recorder.over}
    Output(json).result(result, f"{file}: {recorder.lines} messages in {times}; {end}")


@app.command("game", short_help="Record what a Formula One game sends")
def game(
    file: FileArgument,
    port: PortOption = None,
    silent: Annotated[
        float | None, typer.Option("--until-silent", metavar="S", min=0.1, help="End after so many seconds without a packet.")
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Record the packets that a Formula One game sends, until Ctrl-C.

    Switch UDP telemetry on in the game's settings, format 2023 to 2026, and
    send it to this machine's address and the port.

    [bold]Examples[/bold]

    rsrl record game race.packets
    rsrl record game race.packets --port 20778
    rsrl record game race.packets --until-silent 60 --json
    """
    from rsrl.feeds.anomalies import Anomalies
    from rsrl.feeds.games import DEFAULT_PORT, PacketWriter, decode, listen

    check_file(file, force, "FILE")
    faults = Anomalies()

    async def run(writer: PacketWriter) -> None:
        async for since_s, data in listen(port or DEFAULT_PORT, faults, patience_s=silent):
            kinds = len(faults.counts)
            decode(data, faults)
            if len(faults.counts) > kinds:
                tell(f"rsrl: {faults.examples[-1]}")
            writer.write(since_s, data)

    with PacketWriter(file) as writer:
        _until_interrupted(run(writer))
    result = {"path": str(file), "packets": writer.count, "faults": dict(faults.counts)}
    Output(json).result(result, f"{file}: {writer.count} packets{_and_faults(faults)}")


@app.command("play", short_help="Send a recording of a game again")
def play_back(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A recording of rsrl record game.")],
    port: PortOption = None,
    host: Annotated[str, typer.Option("--host", metavar="ADDRESS", help="Where to send the packets.")] = "127.0.0.1",
    speed: Annotated[float, typer.Option("--speed", metavar="X", min=0.01, help="Times as fast as they came.")] = 1.0,
    json: JsonOption = False,
) -> None:
    """Send a recording of a game again, as the game did.

    [bold]Examples[/bold]

    rsrl record play race.packets
    rsrl record play race.packets --speed 10
    rsrl record play race.packets --json
    """
    from rsrl.feeds.anomalies import Anomalies
    from rsrl.feeds.games import DEFAULT_PORT, play, read_packets

    faults = Anomalies()
    sent = _until_interrupted(play(read_packets(file, faults), port or DEFAULT_PORT, host, speed))
    result = {"path": str(file), "packets": sent, "faults": dict(faults.counts)}
    Output(json).result(result, f"{file}: {'interrupted' if sent is None else f'{sent} packets sent'}{_and_faults(faults)}")


def _and_faults(faults: "Anomalies") -> str:
    return f"; {faults.summary()}" if faults.counts else ""


def _until_interrupted(work: Coroutine[Any, Any, Any]) -> Any:
    """What the work comes to; None where Ctrl-C ended it, which is how a recording ends."""
    try:
        return asyncio.run(work)
    except KeyboardInterrupt:
        return None
