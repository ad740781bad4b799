// One way to write each kind of figure.
import type { Interval } from '../schema'
import type { Call, Status } from './types'

export const MINUS = '\u2212'
export const MISSING = '\u2013'

export const CALL_WORDS: Record<Call, string> = { stay: 'Stay out', soft: 'Box for soft', medium: 'Box for medium', hard: 'Box for hard' }
export const STATUS_WORDS: Record<Status, string> = { green: 'Green', vsc: 'Virtual safety car', sc: 'Safety car', red: 'Red flag' }
export const STATUS_SHORT: Record<Status, string> = { green: 'GREEN', vsc: 'VSC', sc: 'SC', red: 'RED' }
export const COMPOUND_WORDS: Record<string, string> = { S: 'soft', M: 'medium', H: 'hard', I: 'intermediate', W: 'wet' }

/** Letter of the compound that a call boxes for; null for staying out. */
export const letterOf = (call: Call): string | null => (call === 'stay' ? null : call[0]!.toUpperCase())

export function fixed(value: number | null | undefined, digits = 1): string {
  if (value === null || value === undefined) return MISSING
  const text = Math.abs(value).toFixed(digits)
  return value < 0 && Number(text) !== 0 ? MINUS + text : text
}

/** With its sign; zero has none. */
export function signed(value: number | null | undefined, digits = 1): string {
  if (value === null || value === undefined) return MISSING
  const text = Math.abs(value).toFixed(digits)
  return Number(text) === 0 ? text : (value > 0 ? '+' : MINUS) + text
}

export const range = (of: Interval, digits = 2, write = signed): string => `${write(of.low, digits)} to ${write(of.high, digits)}`

export const percent = (share: number | null | undefined): string => {
  if (share === null || share === undefined) return MISSING
  if (share > 0 && share < 0.005) return '<1'
  if (share < 1 && share > 0.995) return '>99'
  return (100 * share).toFixed(0)
}

/** A lap time: `1:35.123`. */
export function lapTime(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined) return MISSING
  const thousandths = Math.round(seconds * 1000)
  const minutes = Math.floor(thousandths / 60000)
  const rest = ((thousandths - minutes * 60000) / 1000).toFixed(3)
  return minutes ? `${minutes}:${rest.padStart(6, '0')}` : rest
}

/** A moment of the race: `0:24:05`. */
export function raceTime(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds))
  const two = (value: number): string => String(value).padStart(2, '0')
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`
}

export const laps = (count: number): string => `${count} lap${count === 1 ? '' : 's'}`

export const sentence = (text: string): string => text.charAt(0).toUpperCase() + text.slice(1)
