// How a car's line is drawn: its team's colour, the second car of a team dashed, the chosen one thick and in ink.
import type uPlot from 'uplot'
import type { SessionCar } from '../schema'
import { readable } from '../lib/colour'
import { ink } from '../lib/theme.svelte'

export function carSeries(cars: readonly SessionCar[], chosen: string, theme: 'dark' | 'light', points = false): uPlot.Series[] {
  return cars.map((car) => {
    const own = car.driver === chosen
    const series: uPlot.Series = {
      label: car.driver,
      stroke: own ? ink('ink') : readable(car.colour, theme),
      width: own ? 2.6 : 1.2,
      points: { show: points, size: own ? 5 : 3.5, fill: own ? ink('ink') : readable(car.colour, theme) },
      spanGaps: false,
    }
    if (car.dashed && !own) series.dash = [5, 3]
    return series
  })
}

/** Cars with the chosen one last, so that its line lies on top. */
export const drawnOrder = (cars: readonly SessionCar[], chosen: string): SessionCar[] => [
  ...cars.filter((car) => car.driver !== chosen),
  ...cars.filter((car) => car.driver === chosen),
]
