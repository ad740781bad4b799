"""A few sentences with the main results; each number in them stands in the section that the sentence points to."""

from collections.abc import Sequence
from typing import NamedTuple

from rsrl.report.criteria import met
from rsrl.report.differences import tally
from rsrl.report.explained import headline
from rsrl.report.leaderboard import model_row, reference
from rsrl.report.numbers import counted, percent, place, place_range, race_title, signed, signed_range, verdict, whole
from rsrl.report.results import Results
from rsrl.report.robustness import verdicts
from rsrl.report.scored import OVER, find, spans, tracks_over
from rsrl.report.strategies import told_races
from rsrl.results import Comparison, Evaluation, Interval, Participant, Robustness, Row, Scored, StudyResult, TrackDifference


class Sentence(NamedTuple):
    """What is said, and the sections its numbers stand in."""

    text: str
    sections: tuple[str, ...]


def summary(results: Results) -> list[Sentence]:
    """Sentences in the order of the sections."""
    study, evaluation, robust, explanation = results
    sentences = [_evaluated(evaluation)] if evaluation else []
    if study:
        sentences += _studied(study)
    if robust:
        sentences.append(_robust(robust))
    return [*sentences, *(Sentence(*told) for told in (headline(explanation) if explanation else []))]


def _evaluated(document: Evaluation) -> Sentence:
    where = f"{document.driver} at {race_title(document.race)}, {whole(document.races)} races"
    aggregate, model = document.aggregate, model_row(document)
    own = aggregate or model
    others = aggregate.comparisons if aggregate else [row for row in document.rows if row is not model]
    # hindsight knows the races in advance: a bound, not a competitor
    best = min((row for row in others if row.strategist != "hindsight"), key=lambda row: row.difference, default=None)
    parts = [f"{where}: {reference(document)} finishes at P{place(own.mean_position)} on average"] if own else [where]
    if model and model.gap_closed is not None:
        parts[0] += f" and closes {percent(model.gap_closed)} of the gap from fixed strategies to hindsight"
    if best:
        parts.append(_against(best, best.difference_ci95, "the best of the others"))
    return Sentence("; ".join(parts) + ".", ("leaderboard",))


def _against(other: Comparison | Row | TrackDifference, ends: Interval | None, what: str) -> str:
    """The model against another strategist, in words: ahead or behind only where the interval excludes zero."""
    sure = {1: "surely ahead of", 0: "too close to call against", -1: "surely behind"}[verdict(ends)]
    return f"it is {sure} {other.strategist}, {what} ({signed(other.difference)} places, {signed_range(ends)})"


def _studied(study: StudyResult) -> list[Sentence]:
    scored, model = study.tracks, study.reference
    sentences = [_over(scored, study.strategists, model, ("positions", "differences"))] if scored.table else []
    if model and scored.best_baselines:
        sentences += [_by_track(scored, model), _reasonable(scored, model)]
    held_out = study.held_out
    if held_out and held_out.table:
        told = _over(held_out, study.strategists, model, ("held-out",))
        sentences.append(told._replace(text=f"Held-out season {held_out.races[0].season}: {told.text}"))
    return sentences


def _over(scored: Scored, strategists: Sequence[Participant], model: str | None, sections: tuple[str, ...]) -> Sentence:
    """Averages over all and over unseen tracks, of the model or, without one, of the best baseline."""
    kinds = {row.strategist: row.kind for row in strategists}
    full = [row for row in scored.averages if row.over == "all" and row.tracks == tracks_over(scored, "all")]
    best = min((r for r in full if kinds.get(r.strategist) == "baseline"), key=lambda row: row.mean_position, default=None)
    own = next((row for row in scored.averages if row.strategist == model and row.over == "all"), best)
    where = f"Over {counted(len(scored.races), 'track')}, {told_races(strategists)} at each"
    if own is None:
        return Sentence(f"{where}: nobody called all of them.", sections)
    parts = [f"{where}, {own.strategist} finishes at P{place(own.mean_position)} on average ({place_range(own.ci95)})"]
    unseen = find(scored.averages, strategist=own.strategist, over="unseen") if "unseen" in spans(scored) else None
    if unseen:
        parts.append(f"over {OVER['unseen']} at P{place(unseen.mean_position)}")
    behind = find(scored.differences, strategist=best.strategist, race="all") if best and best is not own else None
    if best and behind:
        parts.append(_against(behind, behind.ci95, "the best baseline on average"))
    return Sentence("; ".join(parts) + ".", sections if behind else sections[:1])


def _by_track(scored: Scored, model: str) -> Sentence:
    count = tally(scored, model)
    return Sentence(
        f"Against the best baseline of each track {model} is surely ahead at {count.ahead}, surely behind at {count.behind}, "
        f"and {count.open} are too close to call.",
        ("differences",),
    )


def _reasonable(scored: Scored, model: str) -> Sentence:
    count = met(scored, model)
    return Sentence(f"Its commonest strategy meets all three criteria of the paper at {count.met} of {count.judged} tracks.", ("criteria",))


def _robust(document: Robustness) -> Sentence:
    counts = verdicts(document)
    return Sentence(
        f"Among other rivals and with other figures, the model is surely ahead in {counts[1]} of {counts.total()} comparisons and "
        f"surely behind in {counts[-1]}.",
        ("robustness",),
    )
