"""Who takes part in a study: models with what they trained on, and strategists by name."""

from collections.abc import Mapping, Sequence
from typing import Final

from rsrl.agents import TRAINING_SEED, ModelMetadata, load_agent
from rsrl.errors import RsrlError
from rsrl.evaluation.paired import APART
from rsrl.evaluation.study.scoring import Entrant
from rsrl.season import GROUPS, group_races, race_names
from rsrl.state import input_names
from rsrl.strategists import STRATEGISTS, find_model

PREFERRED: Final = ("fixed", "heuristic", "imitation", "best-plan-sc", "dp", "planner")


def default_strategists() -> tuple[str, ...]:
    """The names of `PREFERRED` that are strategists."""
    return tuple(name for name in PREFERRED if name in STRATEGISTS)


def make_entrants(models: Mapping[str, str], strategists: Sequence[str], races: int, races_of: Mapping[str, int]) -> tuple[Entrant, ...]:
    """Models by name and place, then strategists; `races_of` those of some who call fewer.

    Raises:
        RsrlError: unknown strategist or model, one that cannot run, or `races_of` somebody who takes no part.
    """
    unknown = [name for name in strategists if name not in STRATEGISTS]
    if unknown:
        raise RsrlError(f"unknown strategist {unknown[0]!r}; there are {', '.join(STRATEGISTS)}, and models with --models NAME=FOLDER")
    taken = [name for name in models if name in STRATEGISTS]
    if taken:
        raise RsrlError(f"a model cannot be called {taken[0]}, a strategist's name; give it another, --models NAME=FOLDER")
    names = (*models, *dict.fromkeys(strategists))
    if not names:
        raise RsrlError("nobody to study; name models with --models NAME=FOLDER, or strategists with --strategists")
    absent = [name for name in races_of if name not in names]
    if absent:
        raise RsrlError(f"races of {absent[0]!r}: no such strategist takes part; there are {', '.join(names)}")
    count = {name: races_of.get(name, races) for name in names}
    return (
        *(Entrant(name, place, True, trained_races(name, _checked(name, place)), count[name]) for name, place in models.items()),
        *(Entrant(name, name, False, (), count[name]) for name in names[len(models) :]),
    )


def trained_races(name: str, about: ModelMetadata) -> tuple[str, ...]:
    """Names of the races a model trained on: what its file says, a race or a group or several with commas between; else its name."""
    said = [word.strip() for word in about.race.split(",") if word.strip()]
    known = set(race_names())
    for words in (said, [name]):
        if words and all(word in known or word in GROUPS for word in words):
            return tuple(dict.fromkeys(race for word in words for race in (group_races(word) if word in GROUPS else (word,))))
    return ()


def first_race_apart(entrants: Sequence[Entrant], seed: int) -> int:
    """Number of the first race to call: 0, but `APART` where a model trained on races of this very seed."""
    trained = [load_agent(find_model(e.strategist))[1].seed for e in entrants if e.is_model]
    return APART if seed - TRAINING_SEED in trained else 0


def _checked(name: str, place: str) -> ModelMetadata:
    agent, about = load_agent(find_model(place))
    if agent.feature_names != input_names(agent.feature_set):
        raise RsrlError(f"{name}: trained on another version of the {agent.feature_set!r} features; train the model again")
    return about
