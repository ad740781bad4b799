"""Figures that cannot be estimated from laps, from the literature and the regulations."""

from typing import Final

from rsrl.season import Figure

DRS_WINDOW: Final = Figure(1.0, 0.0, 0, "sporting regulations")
PASS_LOSS: Final = Figure(0.15, 0.15, 0, "0.3 s for each of the two in Heilmeier et al. 2020; half of it, as the passing car uses DRS")
FUEL_START: Final = Figure(110.0, 2.0, 0, "technical regulations: 110 kg at most")
FUEL_S_PER_KG: Final = (0.031, 0.004)  # at 5.2 km a lap: Bayesian fit of 2022-24; 0.023-0.039 elsewhere
AGEING: Final = "Heilmeier et al. 2020: tyres age x0.25 under SC, x0.5 under VSC"
SC_WEAR: Final = Figure(0.25, 0.1, 0, AGEING)
VSC_WEAR: Final = Figure(0.5, 0.15, 0, AGEING)
COLD_S: Final = (1.0, 0.3)  # out-lap on cold tyres, Bayesian fit
RATIO_VSC: Final = (20 / 28, 0.1)  # published for Singapore: green 28 s, VSC 20 s, SC 15 s
RATIO_SC: Final = (15 / 28, 0.1)
SC_LAPS: Final = (0.0, 0.182, 0.25, 0.227, 0.193, 0.057, 0.068, 0.023)  # Heilmeier et al. 2020
VSC_LAPS: Final = (0.479, 0.396, 0.021, 0.104)  # after the same source, which gives 1 to 4 laps
