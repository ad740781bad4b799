import { svelte } from '@sveltejs/vite-plugin-svelte'
import { defineConfig, type Plugin } from 'vite'

/** Kinds of line that no chart here draws: without the mention of them they are left out of the build. */
const UNDRAWN = [/\(paths\.stepped\s*= stepped\);/, /\(paths\.bars\s*= bars\);/, /\(paths\.spline\s*= monotoneCubic\);/, /uPlot\.join = join;/]

const onlyLines: Plugin = {
  name: 'only-lines',
  enforce: 'pre',
  transform(code, id) {
    if (!id.includes('uPlot.esm.js')) return null
    return UNDRAWN.reduce((left, mention) => {
      if (!mention.test(left)) throw new Error(`uPlot no longer has ${mention}`)
      return left.replace(mention, '')
    }, code)
  },
}

// Fixed names and no inlined files: the server's content-security policy allows only files of its own, and diffs stay readable.
export default defineConfig({
  base: './',
  plugins: [onlyLines, svelte()],
  build: {
    target: 'es2022',
    outDir: '../src/rsrl/wall/assets',
    emptyOutDir: true,
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rolldownOptions: {
      output: { entryFileNames: 'wall.js', chunkFileNames: '[name].js', assetFileNames: 'wall[extname]' },
    },
  },
})
