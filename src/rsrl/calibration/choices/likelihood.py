"""The likelihood of what teams chose, given the tyres (JAX): sequences, stop laps, first stints that were cut short, and lap times.

A car runs a sequence with probability (1 - lapse) softmax(-(value + preference for the starting tyre) / temperature) + lapse x frequency:
teams choose well, not perfectly, and sometimes for reasons outside the model (Marschak's random utility; lapses as in psychophysics).
Stop laps fall around the best ones with a temperature of their own. First stints ended by a safety car count as censored.
Slopes of lap times follow wear by a power law, since a driver who makes a set last hides part of its wear.
"""

from typing import Any, Final, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from rsrl.calibration.choices.arrays import ChoiceArrays, RaceArrays
from rsrl.calibration.choices.cost import STEPS, sequence_costs, soft_minimum, stint_cost
from rsrl.calibration.choices.parameters import REFERENCE, Space
from rsrl.calibration.choices.sequences import COMPOUND_TABLE, MAX_STINTS, START

MEDIUM: Final = 1
MIN_TEMPERATURE_S: Final = 0.3
CENSORED_WEIGHT: Final = 0.5
LAPS_WEIGHT: Final = 0.3
"""Weights of first stints and of lap times beside the choices; chosen by what they predict of 2023 (docs/calibration.md)."""

SLOPE_SD: Final = 0.012  # s a lap, of a race's slope about the law
LEVEL_SD_S: Final = 0.25
FIRST_LAPSE: Final = 0.05  # share of first stints that end for reasons of their own


class Tyres(NamedTuple):
    """Tyres of races: offsets against the medium, s, and log wear, s a lap, [races, 3]; preferences for starting tyres, s."""

    offset: Any
    log_wear: Any
    start: Any  # [races, groups, 2], soft and hard


class Plans(NamedTuple):
    """Plans of races as a pit wall sees them."""

    tyres: Tyres
    costs: Any  # [races, sequences, STEPS - 1] by lap of the first stop
    value: Any  # [races, sequences]
    stop_t: Any
    undercut: Any  # [races, 3]


def tyres_of(p: dict[str, Any], a: RaceArrays, race_effects: Any, season_effects: Any) -> Tyres:
    """Tyres from the parameters.

    Args:
        p: parameters by name.
        a: settings.
        race_effects: [races, 4] of log wear, log gap, soft and hard.
        season_effects: [races, 2] of log wear and log gap.
    """
    fresh = jnp.concatenate([jnp.zeros(1), -jnp.cumsum(p["gap"])])
    step = p["wear_step"]
    log_wear = p["wear"] + jnp.concatenate([-jnp.cumsum(step[:REFERENCE][::-1])[::-1], jnp.zeros(1), jnp.cumsum(step[REFERENCE:])])
    known, old = (a.circuit >= 0), (a.rules == 0)
    level = season_effects[:, 1] + known * p["track_gap"][a.circuit] + old * p["old_gap"] + race_effects[:, 1]
    offset = fresh[a.hardness]
    offset = (offset - offset[:, MEDIUM : MEDIUM + 1]) * jnp.exp(level)[:, None]
    offset = offset + jnp.stack([race_effects[:, 2], jnp.zeros(len(a.laps)), race_effects[:, 3]], axis=1)
    severity = season_effects[:, 0] + known * p["track_wear"][a.circuit] + old * p["old_wear"] + race_effects[:, 0]
    start = (p["start"][:, None, :] + p["start_group"])[a.rules]
    return Tyres(offset, log_wear[a.hardness] + severity[:, None], start)


def season_effects(p: dict[str, Any], a: RaceArrays) -> Any:
    """Season effects of races, zero for a season that was not fitted, [races, 2]."""
    known = (a.season >= 0)[:, None]
    return known * jnp.stack([p["season_wear"][a.season], p["season_gap"][a.season]], axis=1)


def plans_of(p: dict[str, Any], a: RaceArrays, tyres: Tyres) -> Plans:
    """Costs of every sequence of every race."""
    stop_t = jax.nn.softplus(p["stop_t"]) + 0.2
    undercut = p["undercut"] + p["undercut_start"][a.rules]

    def one(offset: Any, wear: Any, stop_s: Any, laps: Any, limit: Any, cut: Any) -> Any:
        return sequence_costs(offset, wear, stop_s, laps, limit, cut, stop_t, p["fuel"])

    costs = jax.vmap(one)(tyres.offset, jnp.exp(tyres.log_wear), a.stop_s, a.laps, a.limit, undercut)
    return Plans(tyres, costs, soft_minimum(costs, stop_t), stop_t, undercut)


def utilities(p: dict[str, Any], a: RaceArrays, plans: Plans) -> Any:
    """What a pit wall minimises: value and preference for the starting tyre, s, [races, groups, sequences]."""
    start = plans.tyres.start
    preference = jnp.stack([start[:, :, 0], jnp.zeros(start.shape[:2]), start[:, :, 1]], axis=-1)
    return plans.value[:, None, :] + preference[:, :, START]


def log_choice(p: dict[str, Any], a: RaceArrays, plans: Plans) -> Any:
    """Log probability of every sequence, [races, groups, sequences]."""
    temperature = jax.nn.softplus(p["choice_t"]) + MIN_TEMPERATURE_S
    own = jax.nn.log_softmax(-utilities(p, a, plans) / temperature + a.allowed[:, None, :], axis=-1)
    lapse = jax.nn.sigmoid(p["lapse"])
    return jnp.logaddexp(own + jnp.log1p(-lapse), a.log_frequency[:, None, :] + jnp.log(lapse))


def _log_stops(p: dict[str, Any], a: RaceArrays, plans: Plans, rows: Any) -> Any:
    """Log density of the stop laps of each car, given its sequence."""
    race, sequence, stops = rows[:, 0], rows[:, 1], rows[:, 3]
    laps, limit = a.laps[race], a.limit[race]
    compounds = jnp.array(COMPOUND_TABLE)[sequence]
    offset, wear = plans.tyres.offset, jnp.exp(plans.tyres.log_wear)
    begun, total = jnp.zeros(len(rows)), jnp.zeros(len(rows))
    for stint in range(MAX_STINTS):
        runs = stops >= stint
        stop = rows[:, 4 + stint].astype(float) if stint < MAX_STINTS - 1 else laps
        end = jnp.where(stops > stint, stop, laps)
        length = jnp.maximum(jnp.where(runs, end - begun, 1.0), 0.1)
        c = compounds[:, stint]
        cost = stint_cost(offset[race, c], wear[race, c], begun, length, laps, p["fuel"], limit)
        total = total + jnp.where(runs, cost, 0.0)
        begun = jnp.where(runs, end, laps)
    total = total + stops * a.stop_s[race] + plans.undercut[race, compounds[:, 0]] * rows[:, 4]
    density = -(total - plans.value[race, sequence]) / plans.stop_t - stops * jnp.log(a.laps[race] / STEPS)
    lapse = jax.nn.sigmoid(p["stop_lapse"])
    anywhere = jnp.log(jnp.array([1.0, 1.0, 2.0, 6.0]))[stops] - stops * jnp.log(laps)  # ordered stop laps, uniform
    return jnp.logaddexp(density + jnp.log1p(-lapse), anywhere + jnp.log(lapse))


def _log_first(p: dict[str, Any], a: RaceArrays, plans: Plans, chosen: Any, rows: Any) -> Any:
    """Log probability of a starting tyre with a first stint that ended then (1) or would have ended later (0)."""
    race, compound, group, lap, ended = (rows[:, i] for i in range(5))
    when = jax.nn.softmax(-plans.costs / plans.stop_t, axis=-1)
    step = (a.laps / STEPS)[race][:, None]
    ends = (jnp.arange(STEPS - 1) + 1)[None, :] * step
    apart = (ends - lap[:, None]) / step
    near = jnp.exp(-0.5 * (apart / 0.6) ** 2) / (step * 0.6 * np.sqrt(2 * np.pi))  # the grid of stop laps smoothed over a step
    weight = jnp.where(ended[:, None] == 1, near, jax.nn.sigmoid(apart / 0.35))
    share = jnp.exp(chosen[race, group]) * (jnp.array(START)[None, :] == compound[:, None])
    probability = (share[:, :, None] * when[race] * weight[:, None, :]).sum((1, 2))
    anyhow = 1 / 3 / jnp.where(ended == 1, a.laps[race], 1.0)
    return jnp.log((1 - FIRST_LAPSE) * probability + FIRST_LAPSE * anyhow)


def _lap_misfit(p: dict[str, Any], tyres: Tyres, laps: Any) -> Any:
    """Half the squared misfit of slopes and levels of lap times, [races]."""
    slope = jnp.exp(p["lap_level"] + p["lap_power"] * (tyres.log_wear - jnp.log(0.06))) * 0.06
    slopes = laps[:, :, 2] * (laps[:, :, 0] - slope) ** 2 / (laps[:, :, 1] ** 2 + SLOPE_SD**2)
    levels = laps[:, :, 5] * (laps[:, :, 3] - p["lap_gap"] * tyres.offset) ** 2 / (laps[:, :, 4] ** 2 + LEVEL_SD_S**2)
    return 0.5 * (slopes + levels).sum(1)


def negative_log_posterior(deviates: Any, space: Space, a: RaceArrays, c: ChoiceArrays) -> Any:
    """Negative log posterior of the flat vector."""
    p = space.values(deviates)
    tyres = tyres_of(p, a, p["race"][: len(a.laps)], season_effects(p, a))
    plans = plans_of(p, a, tyres)
    chosen = log_choice(p, a, plans)
    total = 0.5 * (deviates**2).sum()
    total -= (c.weight[:, None, None] * c.counts * chosen).sum()
    total -= (c.stops_weight * _log_stops(p, a, plans, c.stops)).sum()
    total -= CENSORED_WEIGHT * (c.first_weight * _log_first(p, a, plans, chosen, c.first)).sum()
    return total + LAPS_WEIGHT * _lap_misfit(p, tyres, c.laps).sum()
