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
"""Races a model trained on that are told by name."""

READING: Final = (
    (
        None,
        "One race, many callers",
        "Race number i of a seed has the same tyres, safety cars, rivals and luck whoever calls it. So strategists are compared race by "
        "race, and a difference is known far better than either mean.",
    ),
    (
        None,
        "Positions",
        "Mean finishing position of the car that was called, all races counted, retirements where they were classified. Lower is better.",
    ),
    (
        None,
        "Intervals",
        "95 %, Student's t over races. Intervals of two means may overlap widely while their difference is clear of zero: races share "
        "their luck. Surely ahead or behind: the interval is clear of zero. Where nobody is better, one in twenty is so by chance.",
    ),
    (
        "positions",
        "Seen and unseen",
        "Unseen are the tracks no model of the paper's study trains on. What a model itself trained on is underlined; it may be fewer.",
    ),
    (
        "differences",
        "Best baseline",
        "The strategist without a model with the best mean at that track, chosen on these very races: a bar set slightly too high.",
    ),
    (
        "strategies",
        "Stint bars",
        "A bar is a race from left to right, a box a stint with its compound and laps. Brackets below hold 80 % of the stops.",
    ),
    (
        "criteria",
        "Reasonable strategies",
        "The paper's three criteria, asked of the commonest strategy of the races finished: one to three stops; the hardest compound "
        "driven for more laps than the softest; and either like one of the three commonest strategies of fixed or of the best baseline "
        "(as many stops, the same compounds, stops within five laps), or a better mean position than one of them.",
    ),
    (
        "held-out",
        "Held-out races",
        "Dry races of a season that no group of training races holds.",
    ),
    (
        "what-if",
        "Options",
        "Each is driven on in the same futures, the policy calling afterwards. Boxing in 3 laps is settled now, come what may; after "
        "staying out the policy decides, and may wait for a safety car: so it can do better than any lap settled now. Better and worse are "
        "said only where all options together leave one chance in twenty of a false word; equal, where they are within a twentieth of a "
        "place as far as measured. In percent: futures that end in a better, or a worse, place. Rejoins: mean place and median gaps after "
        "the next stop.",
    ),
    (
        "attribution",
        "What the policy looked at",
        "The places by which the call is preferred, shared out by Shapley's rule among what the policy sees, against other races on the "
        "same lap: what is the same in all of them gets nothing. It says what moved the policy; what would move the race is the what-if.",
    ),
    (
        "tree",
        "The tree",
        "A copy of the policy in a few questions. It speaks for the policy only where both make the same call, which is said first.",
    ),
    (
        "decision",
        "A decision explained",
        "Every number is worked out from the policy itself or from races it calls; none is written by hand. What is estimated has a 95 % "
        "interval, 1.96 standard errors either side. A counterfactual is shown only where the policy was asked and did change its call.",
    ),
    (
        "robustness",
        "Robustness",
        "Scale 1 is what the figures are known to; 2 and 3 lie beyond. A lead that shrinks where rivals are called by the model itself was "
        "a lead over weaker rivals.",
    ),
)  # fmt: skip
"""Section it belongs to, None for all, what is explained, and how."""


def what_was_run(files: Mapping[str, Document]) -> Markup:
    """Command, seed, version, machine and date of each file, and a warning where versions differ."""
    rows = [[name, *_run(document.provenance)] for name, document in files.items()]
    heads = ["file", "command", "seed", "RSRL", "machine", "date"]
    others = sorted({str(document.provenance.version) for document in files.values()} - {__version__})
    warning = (
        f"Not all is of one version: this report was made by RSRL {__version__}, results also by {', '.join(others)}." if others else ""
    )
    return together(
        element("p", warning, class_="warning") if warning else "",
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
    return ", ".join(race_title(race) for race in races) or "not told"


def how_to_read(sections: Collection[str]) -> Markup:
    """Explanations of what the report has."""
    told = [(what, how) for section, what, how in READING if section is None or section in sections]
    return element("dl", [together(element("dt", what), element("dd", how)) for what, how in told])


def how_to_make_again(files: Mapping[str, Document], command: str) -> Markup:
    """The commands, to be typed in this order."""
    commands = [str(document.provenance.command) for document in files.values()]
    seeds = "The same seed gives the same races, bit for bit; only times of decisions differ."
    return together(
        element("pre", element("code", "\n".join(dict.fromkeys([*commands, command])))),
        element("p", f"With RSRL {__version__}, the same models, and the season files it ships. {seeds}"),
    )
