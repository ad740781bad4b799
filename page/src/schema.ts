// Made by `npm run types` from src/rsrl/wall/schema.json. Not to be edited.

export interface AskCall {
  version: 1
  type: "ask call"
  lap: number
}

export interface CallMessage {
  version: 1
  type: "call"
  session: string
  driver: string
  lap: number
  look: number
  stage: "policy" | "full"
  time_s: number
  why: string
  status: "green" | "vsc" | "sc" | "red"
  model: string
  value_unit: string
  call: "stay" | "soft" | "medium" | "hard" | null
  words: string
  reason: string
  no_difference: boolean | null
  versus: "stay" | "soft" | "medium" | "hard" | null
  lead: Interval | null
  options: OptionValue[]
  futures: number
  finish: Finish | null
  gaps: GapCar[]
  pit_loss: PitLoss | null
  rejoin: Rejoin | null
  duels: Duel[] | null
  odds: StopOdds[] | null
  window: Window | null
  card: CardEntry[] | null
  training: Training | null
  missing: string[]
  done: "stay" | "box" | null
  took_ms: number
  marks: Record<string, "measured" | "derived" | "assumed">
}

export interface CardEntry {
  status: "vsc" | "sc" | "red"
  call: "stay" | "soft" | "medium" | "hard"
  places: Interval | null
  verdict: "box" | "stay out" | "no difference" | "only one call"
  holds_until: number | null
  looked_until: number
  double_stack_s: number | null
}

export interface ChooseDriver {
  version: 1
  type: "driver"
  driver: string
}

export interface Clock {
  version: 1
  type: "clock"
  session: string
  playing: boolean
  time_s: number
  lap: number
  speed: number
  known_s: number
  known_lap: number
  lap_starts_s: number[]
  delay_s: number
  live: boolean
}

export interface ClockCommand {
  version: 1
  type: "clock"
  command: "play" | "pause" | "step" | "back" | "seek" | "speed" | "live"
  lap?: number | null
  time_s?: number | null
  speed?: number | null
}

export interface Duel {
  kind: "undercut" | "overcut" | "undercut threat" | "overcut threat"
  rival: string
  gap_s: number
  chance: Interval
  futures: number
}

export interface ErrorMessage {
  version: 1
  type: "error"
  code: "malformed" | "too large" | "not now" | "unknown" | "busy" | "too many" | "failed" | "version"
  text: string
  request: number | null
  fatal: boolean
}

export interface Explain {
  version: 1
  type: "explain"
  request: number
  method: "what-if" | "attribution" | "tree" | "counterfactual" | "summary" | "training"
  lap: number
  target?: "stay" | "soft" | "medium" | "hard" | null
}

export interface ExplanationMessage {
  version: 1
  type: "explanation"
  session: string
  request: number
  method: "what-if" | "attribution" | "tree" | "counterfactual" | "summary" | "training"
  lap: number
  driver: string
  call: "stay" | "soft" | "medium" | "hard" | null
  question: string
  unit: string
  baseline: number | null
  exact: boolean
  budget: number
  rows: ExplanationRow[]
  sentences: string[]
  notes: string[]
  details: Record<string, unknown>
  marks: Record<string, "measured" | "derived" | "assumed">
  took_ms: number
}

export interface ExplanationRow {
  label: string
  value: number | null
  low: number | null
  high: number | null
  columns: Record<string, unknown>
}

export interface Finish {
  shares: number[]
  mean: number
  finished: number
}

export interface GapCar {
  driver: string
  position: number
  gap_s: number
  compound: string
  tyre_age_laps: number
  pace_s: number
}

export interface History {
  version: 1
  type: "history"
  session: string
  whole: boolean
  laps: LapOfRace[]
  marks: Record<string, "measured" | "derived" | "assumed">
}

export interface Interval {
  mean: number
  low: number
  high: number
}

export interface LapOfCar {
  driver: string
  lap_time_s: number | null
  gap_to_leader_s: number | null
  position: number
  boxed: boolean
}

export interface LapOfRace {
  lap: number
  status: "green" | "vsc" | "sc" | "red"
  mean_lap_s: number | null
  cars: LapOfCar[]
}

export interface Limits {
  message_bytes: number
  viewers: number
  sessions: number
  delay_s: number
  slowest: number
  fastest: number
}

export interface OptionValue {
  call: "stay" | "soft" | "medium" | "hard"
  label: string
  value: number | null
  places: Interval | null
  points: Interval | null
  time_s: number | null
  better: number | null
  worse: number | null
  mean_position: number | null
  verdict: "itself" | "better" | "worse" | "equal" | "undecided" | null
}

export interface PitLoss {
  green_s: number
  vsc_s: number
  sc_s: number
}

export interface Progress {
  version: 1
  type: "progress"
  request: number
  done: number
  of: number
  words: string
}

export interface Race {
  version: 1
  type: "race"
  session: string
  sequence: number
  time_s: number
  lap: number
  total_laps: number | null
  status: "green" | "vsc" | "sc" | "red"
  status_laps: number
  finished: boolean
  tower: TowerRow[]
  messages: RaceControlMessage[]
  weather: WeatherNow | null
  age_s: number
  marks: Record<string, "measured" | "derived" | "assumed">
}

export interface RaceChoice {
  name: string
  event: string
  season: number
  laps: number
  wet: boolean
  default_driver: string
}

export interface RaceControlMessage {
  time_s: number
  lap: number
  text: string
  topic: string
  driver: string | null
}

export interface RecordingChoice {
  name: string
  race: string
  event: string
  season: number
  kind: "recorded" | "live"
}

export interface Rejoin {
  compound: "stay" | "soft" | "medium" | "hard"
  position: number
  low: number
  high: number
  ahead: string | null
  ahead_share: number
  behind: string | null
  behind_share: number
  gap_ahead_s: number | null
  gap_behind_s: number | null
  traffic_s: Interval
  traffic_laps: number
  futures: number
}

export interface Session {
  version: 1
  type: "session"
  session: string
  kind: "simulated" | "recorded" | "live"
  race: string
  event: string
  season: number
  laps: number | null
  seed: number | null
  race_number: number | null
  driven: string | null
  driver: string
  model: string
  note: string
  methods: ("what-if" | "attribution" | "tree" | "counterfactual" | "summary" | "training")[]
  pit_losses_s: [number, number, number] | null
  cars: SessionCar[]
}

export interface SessionCar {
  driver: string
  number: number | null
  team: string
  colour: string
  dashed: boolean
  grid: number | null
}

export interface SetDelay {
  version: 1
  type: "delay"
  delay_s: number
}

export interface StintBar {
  compound: string | null
  first_lap: number
  last_lap: number
  laps_before: number | null
}

export interface StopOdds {
  driver: string
  position: number
  within_1: number
  within_3: number
  within_5: number
}

export interface TowerRow {
  position: number
  driver: string
  gap_to_leader_s: number | null
  interval_s: number | null
  laps_down: number
  laps: number
  last_lap_s: number | null
  best_lap_s: number | null
  tyre: Tyre
  stops: number
  sets_left: [number, number, number] | null
  pit: "" | "in" | "out"
  penalty_s: number
  note: string
  out: boolean
  stints: StintBar[]
  marks: Record<string, "measured" | "derived" | "assumed">
}

export interface Training {
  share: number
  figures: number
  notes: string[]
}

export interface Tyre {
  compound: string | null
  age_laps: number | null
  new: boolean | null
}

export interface WatchRecorded {
  version: 1
  lap?: number | null
  time_s?: number
  speed?: number | null
  playing?: boolean
  delay_s?: number
  type: "watch recorded"
  name: string
  race: string
  driver?: string | null
}

export interface WatchSimulated {
  version: 1
  lap?: number | null
  time_s?: number
  speed?: number | null
  playing?: boolean
  delay_s?: number
  type: "watch simulated"
  race: string
  driver?: string | null
  seed?: number
}

export interface WeatherNow {
  air_c: number | null
  track_c: number | null
  rain: boolean | null
}

export interface Welcome {
  version: 1
  type: "welcome"
  viewer: string
  rsrl: string
  model: string
  races: RaceChoice[]
  recordings: RecordingChoice[]
  limits: Limits
}

export interface Window {
  first_lap: number | null
  last_lap: number | null
  best_lap: number | null
  compound: string | null
  margin_s: number
}

export type FromServer = Welcome | Session | Clock | Race | History | CallMessage | Progress | ExplanationMessage | ErrorMessage

export type FromViewer = WatchSimulated | WatchRecorded | ChooseDriver | ClockCommand | SetDelay | AskCall | Explain
