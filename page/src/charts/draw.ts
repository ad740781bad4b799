// What all charts draw in the same way: axes, bands of a neutralised race, names at the ends of lines.
import type uPlot from 'uplot'
import { ink } from '../lib/theme.svelte'
import { STATUS_SHORT } from '../lib/format'
import type { Band } from './series'

const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif'

export const textSize = (): number => parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.86
export const font = (size = textSize(), weight = 400): string => `${weight} ${size}px ${FONT}`

export function axes(format: (value: number) => string): uPlot.Axis[] {
  const common = { stroke: ink('soft'), font: font(), grid: { stroke: ink('grid'), width: 1 }, ticks: { show: false } }
  const size = textSize()
  return [
    { ...common, size: size * 1.6, gap: 2, space: size * 3.5, incrs: [1, 2, 5, 10, 20], values: (_, marks) => marks.map((mark) => String(mark)) },
    { ...common, size: size * 3.1, gap: 3, space: size * 2.1, values: (_, marks) => marks.map((mark) => format(mark)) },
  ]
}

/** Bands behind the lines, each with its name, so that the colour is not all there is. */
export function drawBands(u: uPlot, bands: readonly Band[]): void {
  const { ctx, bbox } = u
  ctx.save()
  ctx.beginPath()
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height)
  ctx.clip()
  for (const { status, first, last } of bands) {
    const left = u.valToPos(first - 0.5, 'x', true)
    const right = u.valToPos(last + 0.5, 'x', true)
    ctx.fillStyle = ink(`band-${status}`)
    ctx.fillRect(left, bbox.top, right - left, bbox.height)
    ctx.fillStyle = ink('ink')
    ctx.font = font(textSize() * devicePixelRatio, 650)
    ctx.textAlign = 'left'
    ctx.textBaseline = 'top'
    ctx.fillText(STATUS_SHORT[status], Math.max(left, bbox.left) + 3 * devicePixelRatio, bbox.top + 3 * devicePixelRatio)
  }
  ctx.restore()
}

export interface EndLabel {
  text: string
  x: number
  y: number
  colour: string
  strong: boolean
}

/** Names beside the ends of lines, moved apart until they can be read; those that would leave the plot are left out, the strong ones never. */
export function drawLabels(u: uPlot, labels: readonly EndLabel[]): void {
  const { ctx, bbox } = u
  const ratio = devicePixelRatio
  const size = textSize() * ratio * 0.95
  const least = size * 1.08
  const top = bbox.top + least / 2
  const bottom = bbox.top + bbox.height - least / 2
  const most = Math.max(1, Math.floor((bottom - top) / least) + 1)
  const strong = labels.filter((label) => label.strong)
  const weak = labels.filter((label) => !label.strong).slice(0, Math.max(0, most - strong.length))
  const placed = [...strong, ...weak]
    .map((label) => ({ ...label, left: u.valToPos(label.x, 'x', true), at: Math.min(Math.max(u.valToPos(label.y, 'y', true), top), bottom) }))
    .sort((a, b) => a.at - b.at)
  for (let i = 1; i < placed.length; i++) placed[i]!.at = Math.max(placed[i]!.at, placed[i - 1]!.at + least)
  for (let i = placed.length - 1, limit = bottom; i >= 0; i--, limit -= least) {
    placed[i]!.at = Math.min(placed[i]!.at, limit)
    limit = placed[i]!.at
  }
  ctx.save()
  ctx.textBaseline = 'middle'
  ctx.textAlign = 'left'
  for (const label of placed) {
    ctx.font = font(size, label.strong ? 750 : 500)
    ctx.fillStyle = label.colour
    ctx.fillText(label.text, label.left + 5 * ratio, label.at)
  }
  ctx.restore()
}
