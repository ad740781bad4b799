// Keys of the page, as the help lists them.
export const KEYS: readonly (readonly [string, string])[] = [
  ['Space', 'start, pause'],
  ['← →', 'one lap back, one lap on'],
  ['− +', 'slower, faster'],
  ['↑ ↓', 'the car ahead, the car behind'],
  ['W', 'why this call'],
  ['R', 'choose a race'],
  ['D', 'broadcast delay'],
  ['T', 'light or dark'],
  ['Esc', 'close'],
  ['?', 'this help'],
]

export const SPEEDS: readonly number[] = [1, 2, 5, 10, 20, 50, 100, 200]

export interface Actions {
  play(): void
  lap(by: -1 | 1): void
  speed(by: -1 | 1): void
  car(by: -1 | 1): void
  open(dialog: 'race' | 'delay' | 'why' | 'help'): void
  theme(): void
}

/** Whether a key belongs to what has the focus, such as a field or a slider. */
function taken(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false
  if (target.closest('dialog, input, select, textarea')) return true
  if (key === ' ' || key === 'Enter') return target.closest('button, a') !== null
  return key.startsWith('Arrow') && target.closest('table, ol') !== null
}

export function onKey(event: KeyboardEvent, actions: Actions): void {
  if (event.ctrlKey || event.metaKey || event.altKey || taken(event.target, event.key)) return
  const deeds: Record<string, () => void> = {
    ' ': () => actions.play(),
    ArrowLeft: () => actions.lap(-1),
    ArrowRight: () => actions.lap(1),
    '+': () => actions.speed(1),
    '=': () => actions.speed(1),
    '-': () => actions.speed(-1),
    ArrowUp: () => actions.car(-1),
    ArrowDown: () => actions.car(1),
    w: () => actions.open('why'),
    r: () => actions.open('race'),
    d: () => actions.open('delay'),
    t: () => actions.theme(),
    '?': () => actions.open('help'),
  }
  const deed = deeds[event.key.length === 1 ? event.key.toLowerCase() : event.key]
  if (!deed) return
  event.preventDefault()
  deed()
}
