"""Stage one: what one race says by itself, from its laps alone.

`pace_and_tyres` fits pace, tyre wear, compounds and fuel; `traffic` and `passing` who is held up; `stops` and `pit` the pit stops; `start`
the first lap; `incidents` the safety cars. `design` is the regression they share, `analysis` puts a race together.
"""

from rsrl.calibration.race.analysis import RaceAnalysis, analyse_race

__all__ = ["RaceAnalysis", "analyse_race"]
