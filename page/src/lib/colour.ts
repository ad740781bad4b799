// Team colours as sent, mixed with ink or paper until they can be read on the page's ground.
const LEAST_CONTRAST = 3

type Rgb = [number, number, number]

const parse = (hex: string): Rgb => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)) as Rgb

function luminance(rgb: Rgb): number {
  const [r, g, b] = rgb.map((part) => {
    const share = part / 255
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4
  }) as Rgb
  return 0.2126 * r + 0.7152 * g + 0.0722 * b
}

const GROUNDS = { dark: luminance([20, 24, 30]), light: luminance([255, 255, 255]) }
const cache = new Map<string, string>()

export function readable(hex: string, theme: 'dark' | 'light'): string {
  const key = theme + hex
  const known = cache.get(key)
  if (known) return known
  const ground = GROUNDS[theme]
  const end = theme === 'dark' ? 255 : 0
  const from = parse(hex)
  let found = hex
  for (let step = 0; step <= 10; step++) {
    const rgb = from.map((part) => Math.round(part + ((end - part) * step) / 10)) as Rgb
    found = `rgb(${rgb.join(' ')})`
    const light = luminance(rgb)
    if ((Math.max(light, ground) + 0.05) / (Math.min(light, ground) + 0.05) >= LEAST_CONTRAST) break
  }
  cache.set(key, found)
  return found
}
