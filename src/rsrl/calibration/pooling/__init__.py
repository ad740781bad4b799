"""Stage two: figures of single races pooled over tracks, seasons, teams and C-numbers.

`tyre` pools tyre wear and compounds; `traffic` passing and dirty air; `pit` the pit stops; `car` pace and form; `incident` safety cars and
retirements; `mixed_effects`, `scalars` and `hazards` are the statistics they share; `season_model` makes the record of any race.
"""

from rsrl.calibration.pooling.season_model import SeasonModel, figure_table, pool

__all__ = ["SeasonModel", "figure_table", "pool"]
