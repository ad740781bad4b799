"""`rsrl audit`: every dry race and car of a season, what calls were worth, and who would have called as the teams did."""

from pathlib import Path
from typing import Annotated, Final

import typer

from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import ForceOption, JsonOption, LapsOption, SeedOption, WideOption
from rsrl.cli.output import Output
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance

SeasonOption = Annotated[int, typer.Option("--season", metavar="YEAR", help="The season to audit.")]
ModelOption = Annotated[
    str, typer.Option("--model", metavar="MODEL", help="The policy: a shipped one such as all, a run folder, model.zip or module:function.")
]
RacesOption = Annotated[
    str | None, typer.Option("--races", metavar="A,B", help="Only these races, such as monza,bahrain. Default: all that can be called.")
]
DriversOption = Annotated[str | None, typer.Option("--drivers", metavar="A,B", help="Only these drivers, such as HAM,verstappen.")]
RolloutsOption = Annotated[
    int,
    typer.Option("--rollouts", metavar="N", min=0, max=100_000, help="Futures of each lap on which calls differ; 0: none."),
]
FilesOption = Annotated[
    Path | None, typer.Option("--season-files", metavar="DIR", help="Use the season files of this folder, not those shipped with RSRL.")
]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", help="Folder for the result, a picture, and each race as it is done. Default: nothing is written."
    ),
]

RESULT_FILE: Final = "audit.json"
PICTURE: Final = "audit.png"
RACES_FOLDER: Final = "races"


def command(
    season: SeasonOption,
    laps: LapsOption,
    model: ModelOption = "all",
    races: RacesOption = None,
    drivers: DriversOption = None,
    rollouts: RolloutsOption = 100,
    season_files: FilesOption = None,
    seed: SeedOption = 0,
    out: OutOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Audit a season: what its calls were worth, by race and by team.

    Every dry race is replayed for every car. Where the team, the policy, the
    best plan before the race (with a safety-car rule) and the model of teams'
    calls differ, each call is simulated from what was known then, on the same
    luck, the policy calling afterwards. Places lost above zero were given away.

    A first stop is matched if a strategist would have made it within two laps
    of the team. The shipped season files know their own race; for figures that
    do not, give --season-files made from the races before.

    With --out each race is kept as soon as it is done: an interrupted command
    loses nothing and goes on when it is repeated.

    [bold]Examples[/bold]

    rsrl audit --season 2024 --laps data/laps --out runs/audit-2024
    rsrl audit --season 2024 --laps data/laps --season-files before-2024 --rollouts 50
    rsrl audit --season 2023 --laps data/laps --races monza --drivers SAI,LEC --json
    """
    output = Output(json, wide)
    if out:
        refuse_overwrite(out / RESULT_FILE, force)
        make_folder(out)
    with progress(output, f"Auditing {season}") as report:
        from msgspec.structs import replace

        from rsrl.audit import Settings, audit_season, season_races
        from rsrl.explanation import load_any_policy
        from rsrl.laps import season_file

        policy = load_any_policy(model)
        found = season_races(season_file(laps, season), season, _words(races), _words(drivers), season_files)
        result = audit_season(season, found, policy, Settings(rollouts, seed), out and out / RACES_FOLDER, report)
    result = replace(result, provenance=provenance(seed))
    if out:
        from rsrl.audit.picture import plot_audit

        write_json(out / RESULT_FILE, result)
        plot_audit(result, out / PICTURE)
    from rsrl.cli.audit_tables import tables

    output.result(result, *(tables(result) if not json else ()))


def _words(text: str | None) -> tuple[str, ...] | None:
    """The words of a list with commas; None for none."""
    return None if text is None else tuple(word.strip() for word in text.split(",") if word.strip())
