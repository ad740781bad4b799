"""What was run, how to read it, and how to make it again."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

from rsrl import __version__
from rsrl.report.markup import Markup, element, together
from rsrl.report.numbers import MISSING, date, race_title, whole
from rsrl.report.results import Document
from rsrl.report.tables import table
from rsrl.results import Participant, Provenance

MOST_NAMED: Final = 3
"""At most so many of the races a model trained on are listed by name."""

READING: Final = (
    (
        None,
        "Same races for all",
        "Race number i of a seed has the same starting tyres, safety cars and random numbers, whoever calls it. So strategists are "
        "compared race by race, and a difference is known far better than either mean.",
    ),
    (
        None,
        "Positions",
        "Mean finishing position of the car that was called, all races counted, retirements where they were classified. Lower is better.",
    ),
    (
        None,
        "Intervals",
        "All intervals are 95 %. Means and paired differences: Student's t over races. Several training seeds: over seeds and races "
        "together, a stratified bootstrap for the interquartile mean and the chance of finishing ahead. Shares of a gap: delta method. "
        "Surely ahead or behind: the interval of the difference excludes zero; an interval that includes zero says neither. Of many "
        "comparisons between equals, one in twenty excludes zero by chance.",
    ),
    (
        "positions",
        "Seen and unseen",
        "Unseen tracks are those that no model of the paper's study trains on. Tracks a model itself trained on are underlined.",
    ),
    (
        "differences",
        "Best baseline",
        "The strategist without a model that has the best mean at a track, chosen in these same races: slightly too strong a competitor.",
    ),
    (
        "strategies",
        "Stint bars",
        "A bar is a race from left to right, a box a stint with its compound and laps. Brackets below hold 80 % of the stops.",
    ),
    (
        "criteria",
        "Reasonable strategies",
        "The paper's three criteria, applied to the commonest strategy of the races finished: one to three stops; the hardest compound "
        "driven for more laps than the softest; and either similar to one of the three commonest strategies of fixed or of the best "
        "baseline (as many stops, the same compounds, stops within five laps), or a better mean position than one of them.",
    ),
    (
        "held-out",
        "Held-out races",
        "Dry races of a season that no model trains on.",
    ),
    (
        "what-if",
        "Options",
        "All options are rolled out in the same futures, with the policy calling every later lap. An option to box in 3 laps is fixed now; "
        "after staying out the policy decides lap by lap, and may use a safety car, so it can do better than any fixed lap. Better and "
        "worse are said only where all options together have a 5 % chance of a wrong statement; equal, where they are within 0.05 places. "
        "In percent: futures that end in a better or a worse place. Rejoins: mean place and median gaps after the next stop.",
    ),
    (
        "attribution",
        "What the policy looked at",
        "The places by which the call is preferred, shared among the policy's features by Shapley values, against other races on the same "
        "lap: what is the same in all of them gets nothing. It says what moved the policy; the what-if says what would move the race.",
    ),
    (
        "tree",
        "The tree",
        "A decision tree fitted to the policy. It explains the policy only where both make the same call, which is stated first.",
    ),
    (
        "decision",
        "A decision explained",
        "Every number is computed from the policy itself or from races it calls. Estimates have normal 95 % intervals. A counterfactual is "
        "shown only where the policy was queried and did change its call.",
    ),
    (
        "robustness",
        "Robustness",
        "At scale 1 the season's figures are drawn within their standard errors; 2 and 3 lie beyond. Where rivals are called by the model "
        "itself, a smaller lead means that part of it was over weaker rivals. Intervals are over draws of the figures.",
    ),
)  # fmt: skip
"""Section of each note (None: all reports), what it explains, and its text."""


def what_was_run(files: Mapping[str, Document]) -> Markup:
    """Command, seed, version, machine and date of each file, its note, and a warning where versions differ."""
    rows = [[name, *_run(document.provenance)] for name, document in files.items()]
    heads = ["file", "command", "seed", "RSRL", "machine", "date"]
    others = sorted({str(document.provenance.version) for document in files.values()} - {__version__})
    warning = (
        f"Not all is of one version: this report was made by RSRL {__version__}, results also by {', '.join(others)}." if others else ""
    )
    return together(
        element("p", warning, class_="warning") if warning else "",
        [
            element("p", f"{name}: {document.provenance.note}", class_="warning")
            for name, document in files.items()
            if document.provenance.note
        ],
        table("Where the results come from", heads, rows, class_="runs"),
    )


def _run(provenance: Provenance) -> list[str | Markup]:
    machine = provenance.machine
    told = f"{machine.cpu}, {machine.cores} cores, Python {machine.python}, {machine.platform}"
    engine = provenance.engine
    seed = provenance.seed
    return [
        element("code", provenance.command),
        MISSING if seed is None else str(seed),
        provenance.version,
        told + (f", engine {engine}" if engine else ""),
        date(provenance.date),
    ]


def who_took_part(strategists: Sequence[Participant]) -> Markup:
    """Kind, races at each track, and training of each strategist of a study."""
    rows = [
        [
            one.strategist,
            one.kind,
            whole(one.races),
            _training(one.trained_on) if one.kind == "model" else "",
            element("code", one.model_hash or ""),
        ]
        for one in strategists
    ]
    return table("Who took part", ["strategist", "kind", "races a track", "trained on", "model"], rows, class_="runs")


def _training(races: Sequence[str]) -> str:
    """The races a model trained on, only counted where there are many."""
    if len(races) > MOST_NAMED:
        return f"{len(races)} races"
    return ", ".join(race_title(race) for race in races) or "unknown"


def how_to_read(sections: Collection[str]) -> Markup:
    """Explanations of what the report has."""
    told = [(what, how) for section, what, how in READING if section is None or section in sections]
    return element("dl", [together(element("dt", what), element("dd", how)) for what, how in told])


def how_to_make_again(files: Mapping[str, Document], command: str) -> Markup:
    """The commands, to be typed in this order."""
    commands = [str(document.provenance.command) for document in files.values()]
    seeds = "The same seed gives the same races, bit for bit; only decision times differ."
    return together(
        element("pre", element("code", "\n".join(dict.fromkeys([*commands, command])))),
        element("p", f"With RSRL {__version__}, the same models, and the season files it ships. {seeds}"),
    )
