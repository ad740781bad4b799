// Columns of explanation rows, which differ by method, read with their types.
import type { ExplanationRow } from '../schema'

export function number(row: ExplanationRow, name: string): number | null {
  const value = row.columns[name]
  return typeof value === 'number' ? value : null
}

export function text(row: ExplanationRow, name: string): string {
  const value = row.columns[name]
  return typeof value === 'string' ? value : typeof value === 'number' ? String(value) : ''
}
