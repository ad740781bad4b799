// The one store of the page, fed by the WebSocket. Messages are kept as they come and replaced whole, so an update costs what it shows.
import type {
  CallMessage, Clock, ExplanationMessage, FromServer, History, LapOfRace, Progress, Race, Session, SessionCar, TowerRow, Welcome,
} from '../schema'
import { Connection, socketAddress, type Said } from './connection'
import { readLink, writeLink, type Watched } from './link'
import type { Method } from './types'

export const STALE_S = 15
const PLAYED = 'rsrl-played'
const FIRST_SPEED = 10
const LONGEST_WAY_MS = 4000

/** What a reload takes up again, beside the link. */
interface Played {
  playing: boolean
  speed: number
  delay_s: number
}

export interface Asked {
  key: string
  progress: Progress | null
  answer: ExplanationMessage | null
  error: string
}

class Wall {
  welcome = $state.raw<Welcome | null>(null)
  session = $state.raw<Session | null>(null)
  clock = $state.raw<Clock | null>(null)
  race = $state.raw<Race | null>(null)
  laps = $state.raw<readonly LapOfRace[]>([])
  historyMarks = $state.raw<History['marks']>({})
  call = $state.raw<CallMessage | null>(null)
  /** Calls of laps that were asked for, by lap. */
  earlier = $state.raw<ReadonlyMap<number, CallMessage>>(new Map())
  asked = $state.raw<ReadonlyMap<string, Asked>>(new Map())
  connected = $state.raw(false)
  everConnected = $state.raw(false)
  againAt = $state.raw(0)
  heardAt = $state.raw(0)
  now = $state.raw(0)
  notice = $state.raw('')
  waiting = $state.raw(false)
  /** Whether there is something to show: a race that was asked for, or the last one while it is asked for again. */
  shown = $state.raw(false)

  cars = $derived(new Map<string, SessionCar>(this.session?.cars.map((car) => [car.driver, car]) ?? []))
  driver = $derived(this.session?.driver ?? '')
  row = $derived<TowerRow | undefined>(this.race?.tower.find((row) => row.driver === this.driver))
  delayed = $derived((this.clock?.delay_s ?? 0) > 0)
  /** The newest lap whose call can be explained; 0 before the first. */
  explained = $derived(this.call ? (this.call.call ? this.call.lap : this.race?.finished ? this.call.lap - 1 : 0) : 0)
  /** Seconds without word from the server, or from the source of a live race. */
  silence_s = $derived(this.connected ? Math.max(0, (this.now - this.heardAt) / 1000) : 0)
  stale_s = $derived.by(() => {
    if (!this.connected || !this.race || !this.clock || this.race.finished) return 0
    const source = this.clock.live ? this.race.age_s : 0
    const server = this.clock.playing ? this.silence_s : 0
    const age = Math.max(source, server)
    return age >= STALE_S ? age : 0
  })

  #connection: Connection | null = null
  #watched: Watched | null = null
  #resume: Played | null = null
  #requests = new Map<number, string>()
  #request = 0
  #pendingLaps = new Set<number>()
  #link = ''
  #begunAt = 0

  start(): void {
    this.#watched = readLink(location.hash)
    this.#resume = storedPlay()
    this.#connection = new Connection(() => socketAddress(location, this.#watched !== null), {
      message: (message) => this.#take(message),
      opened: () => undefined,
      lost: (again_ms) => this.#lost(again_ms),
    })
    this.now = Date.now()
    setInterval(() => (this.now = Date.now()), 1000)
    addEventListener('hashchange', () => {
      if (location.hash === this.#link) return
      const watched = readLink(location.hash)
      if (watched) this.watch(watched)
    })
  }

  watch(watched: Watched): void {
    this.#watched = watched
    this.#resume = null
    this.shown = false
    this.#ask()
  }

  say(message: Said): void {
    if (!this.#connection?.say(message)) this.notice = 'Not connected: nothing was sent.'
  }

  retry(): void {
    this.#connection?.retry()
  }

  chooseDriver(driver: string): void {
    if (driver !== this.driver) this.say({ type: 'driver', driver })
  }

  play(): void {
    this.say({ type: 'clock', command: this.clock?.playing ? 'pause' : 'play' })
  }

  seekLap(lap: number): void {
    this.say({ type: 'clock', command: 'seek', lap })
  }

  explain(method: Method, lap: number): void {
    const key = this.key(method, lap)
    const before = this.asked.get(key)
    if (before && !before.error) return
    this.#request += 1
    this.#requests.set(this.#request, key)
    this.#put({ key, progress: null, answer: null, error: '' })
    this.say({ type: 'explain', request: this.#request, method, lap })
  }

  key(method: Method, lap: number): string {
    const call = lap === this.call?.lap ? this.call : this.earlier.get(lap)
    return [this.session?.session, this.driver, method, lap, call?.look ?? ''].join(' ')
  }

  askCall(lap: number): void {
    if (lap === this.call?.lap || this.earlier.has(lap) || this.#pendingLaps.has(lap)) return
    this.#pendingLaps.add(lap)
    this.say({ type: 'ask call', lap })
  }

  /** The address of what is shown now. */
  address(): string {
    return new URL(writeLink(this.#place()), location.href).href
  }

  #place(): Watched {
    const watched = this.#watched ?? { recording: null, race: '', driver: null, seed: 0, lap: null, time_s: null }
    return { ...watched, driver: this.driver || watched.driver, time_s: this.clock && !this.clock.live ? this.clock.time_s : null, lap: null }
  }

  #ask(): void {
    const watched = this.#watched
    if (!watched) return
    const { race, driver, seed, recording, lap, time_s } = watched
    const { playing, speed, delay_s } = this.#resume ?? { playing: true, speed: FIRST_SPEED, delay_s: 0 }
    const begin = { lap: time_s === null ? lap : null, time_s: (time_s ?? 0) + delay_s, playing, speed, delay_s }
    this.waiting = true
    if (recording) this.say({ type: 'watch recorded', name: recording, race, driver, ...begin })
    else this.say({ type: 'watch simulated', race, driver, seed, ...begin })
  }

  #take(message: FromServer): void {
    this.heardAt = this.now = Date.now()
    switch (message.type) {
      case 'welcome':
        this.welcome = message
        if (this.connected) break // the recordings have been read meanwhile
        this.connected = this.everConnected = true
        this.notice = ''
        this.#ask()
        break
      case 'session':
        this.#begin(message)
        break
      case 'clock':
        if (message.session === this.session?.session) this.#tick(message)
        break
      case 'race':
        if (message.session === this.session?.session) this.race = message
        break
      case 'history':
        if (message.session === this.session?.session) this.#history(message)
        break
      case 'call':
        if (message.session === this.session?.session && message.driver === this.driver) this.#call(message)
        break
      case 'progress':
        this.#answer(message.request, { progress: message })
        break
      case 'explanation':
        this.#answer(message.request, { answer: message })
        break
      case 'error':
        if (message.request !== null && this.#requests.has(message.request)) this.#answer(message.request, { error: message.text })
        else this.notice = message.text
        this.waiting = false
        break
    }
  }

  #begin(session: Session): void {
    if (this.waiting && !this.#isWatched(session)) return // what the server shows at first, before it read what is asked for
    const other = session.session !== this.session?.session
    if (other) {
      this.race = this.clock = null
      this.laps = []
    }
    if (other || this.waiting || session.driver !== this.session?.driver) {
      this.call = null
      this.earlier = new Map()
      this.asked = new Map()
      this.#pendingLaps.clear()
    }
    this.session = session
    this.#begunAt = Date.now()
    this.#resume = null
    this.notice = ''
    this.#watched ??= this.#linkTo(session)
  }

  #isWatched(session: Session): boolean {
    const watched = this.#watched
    return watched === null || (session.race === watched.race && (session.kind === 'simulated') === !watched.recording && (session.seed ?? 0) === watched.seed && (!watched.driver || session.driver === watched.driver))
  }

  /** The link to what the server shows of itself. */
  #linkTo(session: Session): Watched {
    const recording = this.welcome?.recordings.find((one) => one.race === session.race && one.kind === session.kind)?.name ?? null
    return { recording, race: session.race, driver: session.driver, seed: session.seed ?? 0, lap: null, time_s: null }
  }

  /** Whether a clock stands where it was asked to: the server may show its own choice before it reads ours. */
  #isThere(clock: Clock): boolean {
    const { time_s, lap } = this.#watched ?? {}
    if (clock.live || Date.now() - this.#begunAt > LONGEST_WAY_MS) return true
    if (typeof time_s === 'number') return clock.time_s >= Math.min(time_s, clock.known_s) - 5
    return typeof lap !== 'number' || clock.lap >= lap - 2
  }

  #tick(clock: Clock): void {
    if (this.waiting) {
      if (!this.#isThere(clock)) return
      this.waiting = false
    }
    this.shown = true
    const lap = this.clock?.lap
    const back = this.clock !== null && clock.time_s < this.clock.time_s - 0.5
    this.clock = clock
    if (back) {
      this.call = this.call && this.call.time_s <= clock.time_s ? this.call : null
      this.earlier = new Map()
    }
    storePlay({ playing: clock.playing, speed: clock.speed, delay_s: clock.delay_s })
    if (lap !== clock.lap || !clock.playing || back) this.#writeLink()
  }

  #writeLink(): void {
    if (!this.#watched) return
    this.#watched = this.#place()
    this.#link = writeLink(this.#watched)
    if (location.hash !== this.#link) history.replaceState(null, '', this.#link)
  }

  #history(message: History): void {
    this.historyMarks = message.marks
    if (message.whole) {
      this.laps = message.laps
      return
    }
    const laps = new Map(this.laps.map((lap) => [lap.lap, lap]))
    for (const lap of message.laps) laps.set(lap.lap, lap)
    this.laps = [...laps.values()].sort((a, b) => a.lap - b.lap)
  }

  #call(message: CallMessage): void {
    const asked = this.#pendingLaps.has(message.lap) && message.lap !== this.call?.lap
    if (asked && this.call) {
      if (message.stage === 'full' || message.call === null) this.#pendingLaps.delete(message.lap)
      this.earlier = new Map(this.earlier).set(message.lap, message)
    } else {
      if (this.call && this.call.lap !== message.lap) this.earlier = new Map(this.earlier).set(this.call.lap, this.call)
      this.call = message
    }
  }

  #answer(request: number, change: Partial<Asked>): void {
    const key = this.#requests.get(request)
    const before = key === undefined ? undefined : this.asked.get(key)
    if (before) this.#put({ ...before, ...change })
  }

  #put(asked: Asked): void {
    this.asked = new Map(this.asked).set(asked.key, asked)
  }

  #lost(again_ms: number): void {
    if (this.connected && this.clock) {
      const { playing, speed, delay_s } = this.clock
      this.#resume = { playing, speed, delay_s }
      if (this.#watched) this.#watched = this.#place()
    }
    this.connected = false
    this.againAt = Date.now() + again_ms
  }
}

function storedPlay(): Played | null {
  try {
    return JSON.parse(sessionStorage.getItem(PLAYED) ?? 'null') as Played | null
  } catch {
    return null
  }
}

function storePlay(played: Played): void {
  try {
    sessionStorage.setItem(PLAYED, JSON.stringify(played))
  } catch {
    // A browser that stores nothing reloads paused.
  }
}

export const wall = new Wall()
