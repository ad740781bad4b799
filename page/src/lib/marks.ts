// Where figures are from. A message marks paths such as `tower.gap_to_leader_s`; what has no mark of its own has that of what it is part of.
import type { Mark, Marks } from './types'

export const MARK_WORDS: Record<Mark, string> = {
  measured: 'measured: stated by the source',
  derived: 'derived: worked out or simulated from what is known',
  assumed: 'assumed: taken for want of a source',
}

export function markOf(marks: Marks | undefined, path: string): Mark | null {
  for (let part = path; part; part = part.slice(0, Math.max(part.lastIndexOf('.'), 0))) {
    const mark = marks?.[part]
    if (mark) return mark
  }
  return null
}
