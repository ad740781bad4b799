"""The table a pit wall prepares: a line a lap and set, with the call and its worth under a safety car and under a virtual one."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

from rsrl.drawing import CALL_BAND
from rsrl.report.columns import call
from rsrl.report.markup import Markup
from rsrl.report.numbers import MISSING, counted, percent, signed
from rsrl.report.tables import Cell, Group, table
from rsrl.results import MethodResult, SafetyCarRow, from_plain
from rsrl.season import COMPOUND_NAMES, COMPOUNDS
from rsrl.statistics import Z

METHOD: Final = "safety-car table"
STATUSES: Final = ("safety car", "virtual safety car")
STAY: Final = "no pit"
WORTH: Final = (
    "Worth: places gained at the flag by the call over the alternative (staying out, or the best stop), with its 95 % interval. If it is "
    "negative, the call was the worse choice in the simulated futures. In brackets: the share of states with that call, if not all."
)


class Answer(NamedTuple):
    """A call under one status, in words, what it is worth, and whether it is to box."""

    call: str
    worth: str
    boxes: bool


NOTHING: Final = Answer(MISSING, "", False)


class Line(NamedTuple):
    """A lap and the set the car may be on by then; answers under a safety car and under a virtual one."""

    lap: int
    tyre: str
    age_laps: int
    on_plan: bool
    share_of_races: float
    answers: tuple[Answer, ...]


def lines(rows: Sequence[Mapping[str, Any]]) -> list[Line]:
    """Lines of the table's rows in JSON, two of which, one a status, make a line."""
    together: dict[tuple[int, str], dict[str, SafetyCarRow]] = {}
    for row in (from_plain(one, SafetyCarRow) for one in rows):
        together.setdefault((row.lap, row.compound), {})[row.track_status] = row
    return [_line(pair) for pair in together.values()]


def _line(pair: Mapping[str, SafetyCarRow]) -> Line:
    one = next(iter(pair.values()))
    answers = tuple(_answer(pair[status]) if status in pair else NOTHING for status in STATUSES)
    tyre = COMPOUND_NAMES[COMPOUNDS.index(one.compound)]
    return Line(one.lap, tyre, one.tyre_age_laps, one.on_plan, one.share_of_races, answers)


def _answer(row: SafetyCarRow) -> Answer:
    boxes = row.call != STAY
    called = call(row.call) + ("" if row.share_calling_it == 1.0 else f" ({percent(row.share_calling_it)})")
    gained = -row.value if boxes else row.value
    return Answer(called, f"{signed(gained)} ±{Z * row.standard_error:.2f}", boxes)


def safety_car_page_table(one: MethodResult) -> Markup:
    """All lines for the page: the plan's set of a lap first, others that the car may be on below it."""
    answer = [_word("call"), Cell("worth")]
    heads = [Cell("lap"), _word("tyre"), Cell("age, laps"), Cell("on it"), _word("plan"), *answer, *answer]
    groups = (Group("", 5), Group("safety car", 2), Group("virtual safety car", 2))
    cells = [_cells(line) for line in lines(one.rows)]
    note = f"{WORTH} On it: share of the races that are on this tyre by then; plan: it is that of the plan driven most."
    note += f" Estimated from {counted(one.budget, 'rollout')}."
    return table("The call if a safety car comes out before the lap", heads, cells, groups=groups, note=note, class_="prepared")


def _cells(line: Line) -> list[Cell]:
    own = [Cell(str(line.lap)), _word(line.tyre), Cell(str(line.age_laps)), Cell(percent(line.share_of_races))]
    return [*own, _word("yes" if line.on_plan else ""), *_answers(line)]


def _word(text: str, background: str | None = None) -> Cell:
    return Cell(text, "words", background)


def _answers(line: Line) -> list[Cell]:
    shaded = [(answer, CALL_BAND if answer.boxes else None) for answer in line.answers]
    return [cell for answer, background in shaded for cell in (_word(answer.call, background), Cell(answer.worth, None, background))]
