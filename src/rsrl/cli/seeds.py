"""Several run folders given as one model, its training seeds: reading them, and the table of their comparison."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rsrl.cli.output import Column, FittedTable, table
from rsrl.errors import RsrlError
from rsrl.results import Aggregate, Interval, known

if TYPE_CHECKING:
    from rsrl.agents import ModelMetadata, NetworkAgent
    from rsrl.season import RaceRecord
    from rsrl.strategists import ExternalPolicy, Strategist


class Model(NamedTuple):
    """A model under the name it goes by in tables."""

    name: str
    agent: "NetworkAgent | ExternalPolicy"
    about: "ModelMetadata"

    @property
    def network(self) -> "NetworkAgent":
        """Its network. Raises RsrlError for a policy from elsewhere, which may have none."""
        from rsrl.agents import NetworkAgent

        if not isinstance(self.agent, NetworkAgent):
            raise RsrlError(f"{self.name}: a policy from elsewhere, which only `rsrl evaluate` and `rsrl explain` take")
        return self.agent

    def strategist(self, record: "RaceRecord") -> "Strategist":
        """It as a strategist for one race."""
        from rsrl.strategists import strategist_of

        return strategist_of(self.agent, record, self.name)


def load_models(text: str) -> list[Model]:
    """The models of a list such as `runs/a,runs/b`: one under the name of its kind, several under their folders' names as well.

    Raises:
        RsrlError: one can't be read, is named twice, or they differ in kind, race or driver.
    """
    from rsrl.strategists import load_policy

    words = [word.strip() for word in text.split(",") if word.strip()] or [text]
    loaded = [load_policy(word) for word in words]
    if len(set(words)) < len(words):
        raise RsrlError(f"{text}: a model is named twice; name each once")
    first_agent, first = loaded[0]
    for word, (agent, about) in zip(words, loaded, strict=True):
        if (agent.kind, about.race, about.driver) != (first_agent.kind, first.race, first.driver):
            raise RsrlError(
                f"{word}: {agent.kind} for {about.driver} at {about.race}, but {words[0]} is {first_agent.kind} for {first.driver} at "
                f"{first.race}; give models that differ in their seed alone, others with --strategists"
            )
    if len(words) == 1:
        return [Model(first_agent.kind, first_agent, first)]
    names = [f"{first_agent.kind} {Path(word).name}" for word in words]
    if len(set(names)) < len(names):
        names = [f"{first_agent.kind} {word}" for word in words]
    return [Model(name, agent, about) for name, (agent, about) in zip(names, loaded, strict=True)]


def seeds_table(result: Aggregate) -> FittedTable:
    """All seeds together, and each strategist against them."""
    title = (
        f"{result.seeds} seeds together: position {result.mean_position:.2f} "
        f"({_ends(result.mean_position_ci95)}), interquartile mean {result.iqm_position:.2f} ({_ends(result.iqm_position_ci95)})"
    )
    cells = [
        (c.strategist, f"{c.difference:+.2f}", _ends(c.difference_ci95), f"{100 * c.p_better:.0f}", _ends(c.p_better_ci95, 100, 0))
        for c in result.comparisons
    ]
    columns = (Column("strategist", words=True), "behind", "95 %", "ahead %", "95 %")
    caption = "intervals are over training seeds and races; that of the interquartile mean is a stratified bootstrap"
    return table(title, columns, cells, captions=[caption])


def _ends(interval: Interval | None, scale: float = 1.0, digits: int = 2) -> str:
    both = known(interval)
    return "?" if both is None else " to ".join(f"{scale * end:.{digits}f}" for end in both)
