// Light or dark: the system's, unless the reader chose.
const KEY = 'rsrl-theme'
type Name = 'light' | 'dark'

class Theme {
  #system = matchMedia('(prefers-color-scheme: dark)')
  #dark = $state.raw(this.#system.matches)
  #chosen = $state.raw<Name | null>(null)
  name = $derived<Name>(this.#chosen ?? (this.#dark ? 'dark' : 'light'))

  constructor() {
    this.#system.addEventListener('change', (event) => {
      this.#dark = event.matches
      this.#apply()
    })
    try {
      const stored = localStorage.getItem(KEY)
      if (stored === 'light' || stored === 'dark') this.#chosen = stored
    } catch {
      // Nothing stored: the system's.
    }
    this.#apply()
  }

  flip(): void {
    this.#chosen = this.name === 'dark' ? 'light' : 'dark'
    try {
      localStorage.setItem(KEY, this.#chosen)
    } catch {
      // Kept for this visit only.
    }
    this.#apply()
  }

  #apply(): void {
    document.documentElement.dataset.theme = this.name
  }
}

export const theme = new Theme()

/** A colour of the style sheet, for canvases. */
export const ink = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()
