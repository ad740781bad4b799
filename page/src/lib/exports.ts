// What is shown, as files: the picture of the charts, the laps as CSV, everything as JSON. Nothing leaves this machine.
import { CALL_WORDS, range, signed } from './format'
import { ink } from './theme.svelte'
import { wall } from './wall.svelte'

const name = (end: string): string => `${wall.session?.race ?? 'race'}-${wall.driver}-lap-${wall.race?.lap ?? 0}.${end}`

function save(blob: Blob, end: string): void {
  const link = document.createElement('a')
  link.href = URL.createObjectURL(blob)
  link.download = name(end)
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000)
}

export function saveJson(): void {
  const { session, race, laps, call, earlier, asked } = wall
  const explanations = [...asked.values()].flatMap((one) => one.answer ?? [])
  const document = { session, race, laps, call, earlier_calls: [...earlier.values()], explanations }
  save(new Blob([JSON.stringify(document, null, 1)], { type: 'application/json' }), 'json')
}

export function saveCsv(): void {
  const head = 'lap,status,driver,position,lap_time_s,gap_to_leader_s,boxed,mean_lap_s'
  const lines = wall.laps.flatMap((lap) =>
    lap.cars.map((car) => [lap.lap, lap.status, car.driver, car.position, car.lap_time_s ?? '', car.gap_to_leader_s ?? '', Number(car.boxed), lap.mean_lap_s ?? ''].join()),
  )
  save(new Blob([[head, ...lines].join('\n') + '\n'], { type: 'text/csv' }), 'csv')
}

/** The charts as they are on the screen, under the call in words. */
export function savePng(): void {
  const charts = [...document.querySelectorAll<HTMLCanvasElement>('.uplot canvas')]
  const ratio = devicePixelRatio
  const [trace, ...others] = charts
  if (!trace) return
  const gap = 10 * ratio
  const head = 74 * ratio
  const label = 18 * ratio
  const width = Math.max(trace.width, others.reduce((sum, one) => sum + one.width + gap, -gap)) + 2 * gap
  const height = head + label + trace.height + label + Math.max(0, ...others.map((one) => one.height)) + 2 * gap
  const canvas = Object.assign(document.createElement('canvas'), { width, height })
  const ctx = canvas.getContext('2d')
  if (!ctx) return
  ctx.fillStyle = ink('panel')
  ctx.fillRect(0, 0, width, height)
  const write = (text: string, x: number, y: number, size: number, weight = 400): void => {
    ctx.fillStyle = ink('ink')
    ctx.font = `${weight} ${size * ratio}px system-ui, sans-serif`
    ctx.fillText(text, x, y)
  }
  const { session, race, call } = wall
  write(`${session?.event ?? ''} ${session?.season ?? ''}, ${wall.driver}, lap ${race?.lap ?? ''}`, gap, 26 * ratio, 17, 700)
  if (call?.call) {
    const worth = call.lead && call.versus ? `; ${CALL_WORDS[call.versus].toLowerCase()}: ${signed(call.lead.mean, 2)} places [${range(call.lead)}]` : ''
    write(`${call.no_difference ? 'No difference worth a call' : CALL_WORDS[call.call]} (lap ${call.lap})${worth}`, gap, 50 * ratio, 15)
  }
  const titles = [...document.querySelectorAll('.uplot')].map((one) => one.closest('section')?.querySelector('h2')?.firstChild?.textContent?.trim() ?? '')
  write(titles[0] ?? '', gap, head + 12 * ratio, 12, 650)
  ctx.drawImage(trace, gap, head + label)
  let x = gap
  const y = head + label + trace.height
  others.forEach((one, i) => {
    write(titles[i + 1] ?? '', x, y + 13 * ratio, 12, 650)
    ctx.drawImage(one, x, y + label)
    x += one.width + gap
  })
  canvas.toBlob((blob) => blob && save(blob, 'png'))
}
