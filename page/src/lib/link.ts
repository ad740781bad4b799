// What is watched, as the part of the address behind #: a link shares it, and a reload finds it again.
export interface Watched {
  recording: string | null
  race: string
  driver: string | null
  seed: number
  lap: number | null
  time_s: number | null
}

const whole = (text: string | null): number | null => (text !== null && /^\d{1,10}$/.test(text) ? Number(text) : null)

export function readLink(hash: string): Watched | null {
  const fields = new URLSearchParams(hash.replace(/^#/, ''))
  const race = fields.get('race')
  if (!race) return null
  return {
    recording: fields.get('recording'),
    race,
    driver: fields.get('driver'),
    seed: whole(fields.get('seed')) ?? 0,
    lap: whole(fields.get('lap')),
    time_s: whole(fields.get('t')),
  }
}

export function writeLink(watched: Watched): string {
  const fields = new URLSearchParams()
  if (watched.recording) fields.set('recording', watched.recording)
  fields.set('race', watched.race)
  if (watched.driver) fields.set('driver', watched.driver)
  if (!watched.recording) fields.set('seed', String(watched.seed))
  if (watched.time_s !== null) fields.set('t', String(Math.floor(watched.time_s)))
  else if (watched.lap !== null) fields.set('lap', String(watched.lap))
  return `#${fields}`
}
