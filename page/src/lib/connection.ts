// The WebSocket: opens again by itself, ever more slowly, until it is closed on purpose.
import type { FromServer, FromViewer } from '../schema'

const FIRST_WAIT_MS = 500
const LONGEST_WAIT_MS = 8000

type Without<T> = T extends unknown ? Omit<T, 'version'> : never
export type Said = Without<FromViewer>

export interface Listener {
  message(message: FromServer): void
  opened(): void
  lost(again_ms: number): void
}

export class Connection {
  #socket: WebSocket | null = null
  #wait_ms = FIRST_WAIT_MS
  #timer: ReturnType<typeof setTimeout> | undefined
  #heard = false

  constructor(
    private readonly address: () => string,
    private readonly listener: Listener,
  ) {
    this.open()
    addEventListener('online', () => this.retry())
  }

  open(): void {
    clearTimeout(this.#timer)
    const socket = new WebSocket(this.address())
    this.#socket = socket
    this.#heard = false
    socket.onopen = () => this.listener.opened()
    socket.onmessage = (event: MessageEvent<string>) => {
      if (!this.#heard) this.#wait_ms = FIRST_WAIT_MS
      this.#heard = true
      this.listener.message(JSON.parse(event.data) as FromServer)
    }
    socket.onclose = () => {
      if (socket !== this.#socket) return
      this.#socket = null
      this.listener.lost(this.#wait_ms)
      this.#timer = setTimeout(() => this.open(), this.#wait_ms)
      this.#wait_ms = Math.min(2 * this.#wait_ms, LONGEST_WAIT_MS)
    }
  }

  /** Try at once. */
  retry(): void {
    if (!this.#socket) this.open()
  }

  say(message: Said): boolean {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false
    this.#socket.send(JSON.stringify({ version: 1, ...message }))
    return true
  }
}

/** `watching`: the page says itself what it watches, so the server need not show its first race. */
export function socketAddress(location: Location, watching: boolean): string {
  const address = new URL('ws', location.href)
  address.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:'
  address.hash = ''
  const token = new URLSearchParams(location.search).get('token')
  const fields = new URLSearchParams()
  if (token) fields.set('token', token)
  if (watching) fields.set('first', '0')
  address.search = fields.toString()
  return address.href
}
