"""What a tree is fitted to and measured on: episodes with a tree's rows, and the samples drawn from them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.episodes import Calls, EpisodeRecorder, Episodes, Floats
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.strategists import Strategist, Tree, TreeRows, TreeStrategist, made_legal

THINNING: Final = 8
"""One in THINNING of the states in which staying out is clear is kept, with that weight."""

CLEAR_QUANTILE: Final = 0.25
"""Staying out counts as clear where its margin exceeds this quantile of the margins by which the policy stays out."""


@dataclass(frozen=True, kw_only=True)
class TreeEpisodes(Episodes):
    """Episodes labelled by the policy, with the rows that a tree reads.

    Attributes:
        rows: float32 [T, R, C].
        postponed_rows: rows of the states in `postponed`, float32 [T, R, C]; None where those were not recorded.
    """

    rows: Floats
    postponed_rows: Floats | None


class TreeRecorder:
    """Records labelled episodes with a tree's rows.

    Args:
        columns: names of the columns to keep (`tree_columns`); a driving tree reads its own.
        batch: races side by side.
        postpone: also record each state with its stop postponed by a lap.
    """

    def __init__(
        self, policy: ExplainedPolicy, record: RaceRecord, car: int, columns: Sequence[str], batch: int, *, postpone: bool = False
    ) -> None:
        self.race_record, self.car, self.batch = record, car, batch
        self._columns = columns
        self._recorder = EpisodeRecorder(record, car, batch, policy, postpone=postpone)

    def record(self, seed: int, first_race: int, driver: "Tree | Strategist | None" = None) -> TreeEpisodes:
        """Races `first_race`, `first_race` + 1 ... of a seed, driven by a tree made legal, a strategist, or the policy (None)."""
        strategist = TreeStrategist(driver) if isinstance(driver, Tree) else driver
        return with_rows(self._recorder.record(seed, first_race, strategist), self._columns)


def with_rows(episodes: Episodes, columns: Sequence[str]) -> TreeEpisodes:
    """Episodes with a tree's rows of these columns."""
    made = TreeRows(columns)
    made.begin(len(episodes.races))
    rows, postponed = [], []
    for step, raw in enumerate(episodes.raw):
        rows.append(made(raw))
        if episodes.postponed is not None:
            postponed.append(made.peek(episodes.postponed.raw[step]))
    known = {f.name: getattr(episodes, f.name) for f in fields(Episodes)}
    return TreeEpisodes(**known, rows=np.stack(rows), postponed_rows=np.stack(postponed) if postponed else None)


def side_by_side(batches: Sequence[TreeEpisodes]) -> TreeEpisodes:
    """Batches of one record, car and seed as one."""
    own = {f.name for f in fields(TreeEpisodes)} - {"record", "car", "seed"}
    return replace(batches[0], **{name: _joined([getattr(batch, name) for batch in batches]) for name in own})


def _joined(parts: Sequence[Any]) -> Any:
    """Arrays [R] or [T, R, ...] joined along the races; so the arrays of a dataclass or a tuple, one by one."""
    first = parts[0]
    if isinstance(first, np.ndarray):
        return np.concatenate(parts, axis=min(first.ndim, 2) - 1)
    if is_dataclass(first) and not isinstance(first, type):
        return replace(first, **{f.name: _joined([getattr(part, f.name) for part in parts]) for f in fields(first)})
    return None if first is None else tuple(_joined(column) for column in zip(*parts, strict=True))


@dataclass(frozen=True)
class Samples:
    """States with the policy's calls.

    Attributes:
        rows: float32 [N, C].
        labels: int8 [N], the policy's calls made legal as the tree's are.
        stands_for: int64 [N], number of states that each represents.
        at_stake: float32 [N], the policy's best less its worst legal value.
    """

    rows: Floats
    labels: Calls
    stands_for: NDArray[np.int64]
    at_stake: Floats

    def weights(self, stop_weight: float, by_stake: bool) -> NDArray[np.float64]:
        """Weights [N] for fitting: stops count `stop_weight` times; with `by_stake` every state also counts by its `at_stake`."""
        weight = self.stands_for * np.where(self.labels > 0, stop_weight, 1.0)
        return np.asarray(weight * self.at_stake if by_stake else weight, np.float64)


def margins(episodes: Episodes) -> Floats:
    """Value of the best legal call less that of the second best, float32 [T, R]; infinite with one legal call."""
    ordered = np.sort(np.where(episodes.legal, episodes.q, -np.inf), axis=2)
    return np.asarray(ordered[..., 3] - ordered[..., 2], np.float32)


def clear_margin(episodes: Episodes) -> float:
    """Margin above which staying out counts as clear, from races driven by the policy; infinite where it never stays out."""
    stays = margins(episodes)[episodes.choices & (episodes.labels == 0)]
    return float(np.quantile(stays, CLEAR_QUANTILE)) if len(stays) else float("inf")


def samples_of(episodes: TreeEpisodes, clear: float, rng: np.random.Generator) -> Samples:
    """The decisions of races as samples, thinned where staying out is clear."""
    is_clear = (episodes.labels == 0) & (margins(episodes) > clear)
    drawn = rng.random(is_clear.shape) < 1.0 / THINNING
    kept = episodes.choices & (drawn | ~is_clear)
    legal, q = episodes.legal[kept], episodes.q[kept]
    stake = np.where(legal, q, -np.inf).max(axis=1) - np.where(legal, q, np.inf).min(axis=1)
    return Samples(
        episodes.rows[kept], made_legal(episodes.labels[kept], legal), np.where(is_clear[kept], THINNING, 1).astype(np.int64),
        stake.astype(np.float32),
    )  # fmt: skip


def together(parts: Sequence[Samples]) -> Samples:
    """The samples of several parts as one."""
    return Samples(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Samples)))
