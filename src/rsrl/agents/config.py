"""Every learner's settings, one documented field each. The command line and the model file take them from here."""

from dataclasses import asdict, dataclass, fields, replace
from typing import Any, ClassVar, Final, Literal, TypeVar

from rsrl.errors import RsrlError

FeatureSet = Literal["paper", "full", "named"]


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


@dataclass(frozen=True, kw_only=True)
class RsrlConfig(LearnerConfig):
    """RSRL's learner: what each call is worth, from races run on once for every call on the same luck. See rsrl.py.

    Attributes:
        races: races driven per iteration.
        contests: races and cars they are spread over, where there are several.
        minibatch: decisions per gradient step.
        epochs: passes over the decisions of an iteration.
        final_learning_rate: step size at the end; it falls linearly with the budget used.
        clip: largest norm of a gradient.
        value_weight: of the error of a decision's mean outcome, beside that of the differences between its calls.
        expected_weight: finishing places a second of expected time is worth at the start.
        expected_share: how far the policy's advantages are pulled towards what expected time says; noise makes it box too early without.
        own_after: share of the budget after which the policy learned so far drives the races; before, the calls it starts from do.
        uncertainty: scale by which the figures of a race are drawn anew within their standard errors, where there are several races.
        decisions, branch_most, branch_least, branch_scale, all_calls, plan_share, pit_chance, delay_chance: see `environment.Branching`.
    """

    kind: ClassVar[str] = "rsrl"
    feature_set: FeatureSet = "full"
    width: int = 256
    learning_rate: float = 3e-3
    races: int = 2048
    contests: int = 32
    minibatch: int = 512
    epochs: int = 3
    final_learning_rate: float = 3e-5
    clip: float = 10.0
    value_weight: float = 0.05
    expected_weight: float = 0.15
    expected_share: float = 0.3
    own_after: float = 0.75
    uncertainty: float = 1.0
    decisions: int = 12
    branch_most: float = 0.4
    branch_least: float = 0.03
    branch_scale: float = 0.15
    all_calls: float = 0.25
    plan_share: float = 0.2
    pit_chance: float = 0.02
    delay_chance: float = 0.25


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

AGENTS: Final = tuple(sorted(CONFIGS))
"""Names of the agents that can be trained."""
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
