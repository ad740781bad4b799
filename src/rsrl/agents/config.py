"""Every learner's settings, one documented field each. The command line and the model file take them from here."""

from dataclasses import asdict, dataclass, fields, replace
from typing import Any, ClassVar, Literal, TypeVar

from rsrl.errors import RsrlError

FeatureSet = Literal["paper", "full"]


@dataclass(frozen=True, kw_only=True)
class LearnerConfig:
    """What all learners have.

    Attributes:
        feature_set: observations the learner asks the environment for.
        width: units of each hidden layer.
        learning_rate: step size of Adam (AdamW in `dqn` and `drqn`) at the start.
    """

    kind: ClassVar[str]
    feature_set: FeatureSet
    width: int
    learning_rate: float

    @property
    def side_by_side(self) -> int:
        """Races the learner drives at once, which the environment must have room for."""
        return 1


@dataclass(frozen=True, kw_only=True)
class RsrlConfig(LearnerConfig):
    """RSRL's learner: whole races in batch, Q(lambda) back through every lap.

    Attributes:
        races: races collected per iteration.
        minibatch_races: races per gradient step; divides `races`.
        epochs: passes over the collected races.
        final_learning_rate: step size at the end; it falls linearly with the budget used.
        lambda_: mix of long and short returns in Q(lambda), 1 being the whole rest of the race.
        clip: largest norm of a gradient.
        reward_scale: factor on rewards inside the learner; action values are given in the reward's own units.
        plan_share: share of races that follow a random plan up to a random lap, at the start.
        final_plan_share: the same at the end; it falls linearly with the budget used.
        pit_chance: chance per lap to stop for a random tyre where the greedy choice is to stay.
        delay_chance: chance to stay where the greedy choice is to stop.
        outlook_weight: worth of ten seconds of clean-air outlook at the start, in units of scaled reward.
    """

    kind: ClassVar[str] = "rsrl"
    feature_set: FeatureSet = "full"
    width: int = 48
    learning_rate: float = 3e-3
    races: int = 512
    minibatch_races: int = 64
    epochs: int = 2
    final_learning_rate: float = 1e-4
    lambda_: float = 0.97
    clip: float = 5.0
    reward_scale: float = 0.01
    plan_share: float = 0.3
    final_plan_share: float = 0.05
    pit_chance: float = 0.02
    delay_chance: float = 0.25
    outlook_weight: float = 1.5

    @property
    def side_by_side(self) -> int:
        """See `LearnerConfig.side_by_side`."""
        return self.races


@dataclass(frozen=True, kw_only=True)
class PaperConfig(LearnerConfig):
    """What the paper's Table 2 fixes, for its DQN and its DRQN; rewards unscaled, illegal actions punished instead of masked.

    Attributes:
        epsilon: share of random actions in the first episode.
        epsilon_decay: factor on it after each episode.
        min_epsilon: it falls no lower.
        gamma: discount per lap.
        weight_decay: of AdamW.
        replay_transitions: laps the replay buffer holds.
        target_episodes: episodes between copies of the weights to the target network.
        batch: transitions (DRQN: sequences) per gradient step. Left open by the paper.
        update_laps: laps between gradient steps. Left open by the paper.
        huber_delta: error beyond which the loss grows linearly, in points of reward. Left open by the paper;
            1 is the error clipping of the first DQN (Mnih et al., 2015).
    """

    feature_set: FeatureSet = "paper"
    width: int = 64
    learning_rate: float = 0.001
    epsilon: float = 1.0
    epsilon_decay: float = 0.999
    min_epsilon: float = 0.005
    gamma: float = 0.99
    weight_decay: float = 0.001
    replay_transitions: int = 1000
    target_episodes: int = 100
    batch: int = 32
    update_laps: int = 1
    huber_delta: float = 1.0


@dataclass(frozen=True, kw_only=True)
class DqnConfig(PaperConfig):
    """The paper's first model, after Boettinger and Klotz (2023): a feed-forward network, one race at a time."""

    kind: ClassVar[str] = "dqn"


@dataclass(frozen=True, kw_only=True)
class DrqnConfig(PaperConfig):
    """The paper's final model: an LSTM trained on random pieces of past races, after Hausknecht and Stone (2015).

    Attributes:
        sequence_laps: laps of such a piece, 10 as in Hausknecht and Stone; its memory starts empty.
    """

    kind: ClassVar[str] = "drqn"
    sequence_laps: int = 10
    update_laps: int = 4


CONFIGS: dict[str, type[LearnerConfig]] = {c.kind: c for c in (DqnConfig, DrqnConfig, RsrlConfig)}
"""Settings by the learner's name."""

Config = TypeVar("Config", bound=LearnerConfig)


def config_to_dict(config: LearnerConfig) -> dict[str, Any]:
    """The settings as plain values, for a model file."""
    return asdict(config)


def config_from_dict(kind: str, values: dict[str, Any], where: str) -> LearnerConfig:
    """Settings read back from a model file; raises RsrlError where one is unknown or missing."""
    known = {f.name for f in fields(CONFIGS[kind])}
    if set(values) != known:
        odd = ", ".join(sorted(set(values) ^ known))
        raise RsrlError(f"{where}: settings of {kind} differ from this version's ({odd}); train the model again")
    return CONFIGS[kind](**values)


def changed(config: Config, **values: Any) -> Config:
    """A copy with other values; raises RsrlError naming the settings there are."""
    known = {f.name for f in fields(config)}
    for name in values:
        if name not in known:
            raise RsrlError(f"unknown setting {name!r} of {config.kind}; known settings: {', '.join(sorted(known))}")
    return replace(config, **values)
