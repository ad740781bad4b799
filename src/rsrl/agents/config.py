"""Settings of every learner, one documented field each; the command line and model files use them."""

from dataclasses import asdict, dataclass, fields, replace
from typing import Any, ClassVar, Final, Literal, TypeVar

from rsrl.errors import RsrlError

FeatureSet = Literal["paper", "full", "named"]
GoalName = Literal["position", "points", "paper-reward"]


@dataclass(frozen=True, kw_only=True)
class LearnerConfig:
    """Settings common to all learners.

    Attributes:
        feature_set: the observations it learns on.
        width: units of each hidden layer.
        learning_rate: initial step size of Adam (AdamW in `dqn` and `drqn`).
    """

    kind: ClassVar[str]
    feature_set: FeatureSet
    width: int
    learning_rate: float


@dataclass(frozen=True, kw_only=True)
class RsrlConfig(LearnerConfig):
    """RSRL's learner, which estimates advantages from branched races; see `rsrl.agents.rsrl`.

    Attributes:
        goal: what the policy is to make as good as it can, in the mean; see `rsrl.agents.goals`.
        races: races driven per iteration.
        contests: pairs of race and car that they are spread over, where there are several.
        minibatch: decisions per gradient step.
        epochs: passes over an iteration's decisions.
        final_learning_rate: step size at the end of the budget; it falls linearly.
        clip: maximum norm of a gradient.
        value_weight: weight of the error of a decision's mean outcome, relative to that of the differences between calls.
        expected_weight: places that a second of expected time is worth in the initial policy.
        expected_share: share by which the learned advantages are shrunk to those of the initial policy; without it, noise makes the
            policy box too early.
        own_after: share of the budget after which the learned policy drives the races instead of the initial one.
        uncertainty: with several races, the figures of a race are redrawn with this multiple of their standard errors.
        decisions, branch_most, branch_least, branch_scale, all_calls, plan_share, pit_chance, delay_chance: see `rollouts.Branching`.
    """

    kind: ClassVar[str] = "rsrl"
    feature_set: FeatureSet = "full"
    width: int = 256
    learning_rate: float = 3e-3
    goal: GoalName = "position"
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
    """Settings of the paper's DQN and DRQN: its Table 2, and what it leaves open. Illegal actions are penalised, not masked.

    An episode is a race. What the paper leaves open was chosen on races of its own; see docs/paper-agents.md.

    Attributes:
        epsilon: probability of a random action in the first episode.
        epsilon_decay: factor applied after each episode.
        min_epsilon: lower bound.
        gamma: discount factor per lap.
        weight_decay: of AdamW.
        replay_episodes: capacity of the replay buffer.
        target_episodes: episodes between copies of the weights to the target network.
        batch: laps (DRQN: whole races) per gradient step; not given in the paper.
        update_laps: laps driven between gradient steps; not given in the paper.
        races_at_once: races driven side by side with the same weights, before the gradient steps they call for.
        reward_scale: factor of every reward in the loss; not given in the paper.
        average_steps: gradient steps over which the weights kept are averaged, exponentially; not given in the paper.
        validation_episodes: episodes between trials of the weights on races set aside; the best are kept. Not given in the paper.
        validation_races: races of a trial.
    """

    feature_set: FeatureSet = "paper"
    width: int = 64
    learning_rate: float = 0.001
    epsilon: float = 1.0
    epsilon_decay: float = 0.999
    min_epsilon: float = 0.005
    gamma: float = 0.99
    weight_decay: float = 0.001
    replay_episodes: int = 1000
    target_episodes: int = 100
    batch: int = 32
    update_laps: int = 1
    races_at_once: int = 50
    reward_scale: float = 0.01
    average_steps: int = 2000
    validation_episodes: int = 1000
    validation_races: int = 1000


@dataclass(frozen=True, kw_only=True)
class DqnConfig(PaperConfig):
    """The paper's first model, after Boettinger and Klotz (2023): a feed-forward network on single laps."""

    kind: ClassVar[str] = "dqn"


@dataclass(frozen=True, kw_only=True)
class DrqnConfig(PaperConfig):
    """The paper's final model: an LSTM trained on whole past races, after Hausknecht and Stone (2015)."""

    kind: ClassVar[str] = "drqn"
    batch: int = 16
    update_laps: int = 40


CONFIGS: Final[dict[str, type[LearnerConfig]]] = {c.kind: c for c in (DqnConfig, DrqnConfig, RsrlConfig)}
"""Settings by name of the agent."""

AGENTS: Final = tuple(sorted(CONFIGS))
"""Names of the agents that can be trained."""

Config = TypeVar("Config", bound=LearnerConfig)


def config_to_dict(config: LearnerConfig) -> dict[str, Any]:
    """The settings as a dictionary for a model file."""
    return asdict(config)


def config_from_dict(kind: str, values: dict[str, Any], where: str) -> LearnerConfig:
    """Settings from a model file; raises RsrlError where one is unknown or missing."""
    known = {f.name for f in fields(CONFIGS[kind])}
    if set(values) != known:
        odd = ", ".join(sorted(set(values) ^ known))
        raise RsrlError(f"{where}: settings of {kind} differ from this version's ({odd}); train the model again")
    return CONFIGS[kind](**values)


def changed(config: Config, **values: Any) -> Config:
    """A copy with some values changed; raises RsrlError listing the settings where a name is unknown."""
    known = {f.name for f in fields(config)}
    for name in values:
        if name not in known:
            raise RsrlError(f"unknown setting {name!r} of {config.kind}; known settings: {', '.join(sorted(known))}")
    return replace(config, **values)
