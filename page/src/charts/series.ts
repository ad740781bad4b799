// From the history of laps to the lines of the charts.
import type { LapOfCar, LapOfRace } from '../schema'
import type { Status } from '../lib/types'

export type Line = (number | null)[]

export interface Lines {
  laps: number[]
  /** By driver: a value for each lap. */
  of: Map<string, Line>
  /** By driver: whether the car boxed at the end of each lap. */
  boxed: Map<string, boolean[]>
}

export interface Band {
  status: Exclude<Status, 'green'>
  first: number
  last: number
}

export function bands(laps: readonly LapOfRace[]): Band[] {
  const found: Band[] = []
  for (const { lap, status } of laps) {
    if (status === 'green') continue
    const before = found.at(-1)
    if (before && before.status === status && before.last === lap - 1) before.last = lap
    else found.push({ status, first: lap, last: lap })
  }
  return found
}

function lines(laps: readonly LapOfRace[], drivers: readonly string[], value: (car: LapOfCar, lap: LapOfRace, at: number) => number | null): Lines {
  const of = new Map<string, Line>(drivers.map((driver) => [driver, new Array<number | null>(laps.length).fill(null)]))
  const boxed = new Map<string, boolean[]>(drivers.map((driver) => [driver, new Array<boolean>(laps.length).fill(false)]))
  laps.forEach((lap, at) => {
    for (const car of lap.cars) {
      const line = of.get(car.driver)
      if (!line) continue
      line[at] = value(car, lap, at)
      boxed.get(car.driver)![at] = car.boxed
    }
  })
  return { laps: laps.map((lap) => lap.lap), of, boxed }
}

/**
 * Gap of each car, in s and positive behind, to a reference that drives every green lap in the leader's mean green lap and every other lap as
 * the leader did: a field that closes up behind a safety car does so on the chart.
 */
export function traceLines(laps: readonly LapOfRace[], lapStarts_s: readonly number[], drivers: readonly string[]): Lines {
  const ends_s: number[] = []
  laps.forEach((lap, at) => {
    const leader = lap.cars.find((car) => car.gap_to_leader_s === 0)
    const before_s = ends_s[at - 1] ?? lapStarts_s[lap.lap - 1] ?? 0
    ends_s.push(lapStarts_s[lap.lap] ?? before_s + (leader?.lap_time_s ?? lap.mean_lap_s ?? 90))
  })
  const durations = ends_s.map((end, at) => end - (ends_s[at - 1] ?? lapStarts_s[(laps[at]?.lap ?? 1) - 1] ?? 0))
  const green = durations.filter((_, at) => laps[at]!.status === 'green')
  const mean_s = green.reduce((sum, one) => sum + one, 0) / Math.max(green.length, 1)
  let reference_s = lapStarts_s[(laps[0]?.lap ?? 1) - 1] ?? 0
  const references = laps.map((lap, at) => (reference_s += lap.status === 'green' ? mean_s : durations[at]!))
  return lines(laps, drivers, (car, _, at) => (car.gap_to_leader_s === null ? null : ends_s[at]! + car.gap_to_leader_s - references[at]!))
}

/** Gap of each car to the chosen one at the end of each lap, in s, negative ahead of it. */
export function gapLines(laps: readonly LapOfRace[], drivers: readonly string[], chosen: string): Lines {
  const own = laps.map((lap) => lap.cars.find((car) => car.driver === chosen)?.gap_to_leader_s ?? null)
  return lines(laps, drivers, (car, _, at) => {
    const mine = own[at] ?? null
    return mine === null || car.gap_to_leader_s === null ? null : car.gap_to_leader_s - mine
  })
}

/** Further off the mean than this, in s, something else than pace was at work. */
const MOST_OFF_S = 5

function near(time_s: number | null, mean_s: number | null): number | null {
  return time_s === null || mean_s === null || Math.abs(time_s - mean_s) > MOST_OFF_S ? null : time_s - mean_s
}

/** Lap time against the field's mean, in s; without laps into and out of the pits, the first, and those of a neutralised race. */
export function paceLines(laps: readonly LapOfRace[], drivers: readonly string[]): Lines {
  const boxedBefore = (driver: string, at: number): boolean => laps[at - 1]?.cars.find((car) => car.driver === driver)?.boxed ?? false
  return lines(laps, drivers, (car, lap, at) =>
    lap.lap === 1 || lap.status !== 'green' || car.boxed || boxedBefore(car.driver, at) ? null : near(car.lap_time_s, lap.mean_lap_s),
  )
}

/** The value of a line at its last known lap, and that lap's place. */
export function lastOf(line: Line): { at: number; value: number } | null {
  for (let at = line.length - 1; at >= 0; at--) {
    const value = line[at]
    if (value !== null && value !== undefined) return { at, value }
  }
  return null
}

/** The last laps of lines. */
export const lastLaps = (lines: Lines, count: number): Lines => ({
  laps: lines.laps.slice(-count),
  of: new Map([...lines.of].map(([driver, line]) => [driver, line.slice(-count)])),
  boxed: new Map([...lines.boxed].map(([driver, boxed]) => [driver, boxed.slice(-count)])),
})
