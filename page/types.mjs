// Writes src/schema.ts, the types of all messages, from src/rsrl/wall/schema.json; `--check` only compares.
import { readFileSync, writeFileSync } from 'node:fs'

const here = new URL('.', import.meta.url)
const source = new URL('../src/rsrl/wall/schema.json', here)
const target = new URL('src/schema.ts', here)
const definitions = JSON.parse(readFileSync(source, 'utf8')).$defs

const union = (parts) => [...new Set(parts)].join(' | ')
const many = (text) => (text.includes(' | ') ? `(${text})[]` : `${text}[]`)

function type(schema) {
  if (schema.$ref) return schema.$ref.split('/').at(-1)
  if (schema.const !== undefined) return JSON.stringify(schema.const)
  if (schema.enum) return union(schema.enum.map((value) => JSON.stringify(value)))
  const parts = schema.anyOf ?? schema.oneOf
  if (parts) return union(parts.map(type))
  if (schema.type === 'array') return schema.prefixItems ? `[${schema.prefixItems.map(type).join(', ')}]` : many(type(schema.items ?? {}))
  if (schema.type === 'object') {
    if (schema.properties) return 'never'
    return `Record<string, ${schema.additionalProperties === true ? 'unknown' : type(schema.additionalProperties ?? {})}>`
  }
  return { integer: 'number', number: 'number', string: 'string', boolean: 'boolean', null: 'null' }[schema.type] ?? 'unknown'
}

// What a viewer sends may leave out fields with a default; what the server sends has them all.
function declaration(name, schema, sent) {
  if (!schema.properties) return `export type ${name} = ${type(schema)}\n`
  const must = new Set(schema.required ?? [])
  const fields = Object.entries(schema.properties).map(([key, value]) => {
    const optional = sent && !must.has(key) && key !== 'type' && key !== 'version'
    return `  ${key}${optional ? '?' : ''}: ${type(value)}\n`
  })
  return `export interface ${name} {\n${fields.join('')}}\n`
}

const ofViewer = new Set((definitions.FromViewer.oneOf ?? definitions.FromViewer.anyOf).map(type))
const text =
  '// Made by `npm run types` from src/rsrl/wall/schema.json. Not to be edited.\n\n' +
  Object.entries(definitions).map(([name, schema]) => declaration(name, schema, ofViewer.has(name))).join('\n')

if (process.argv.includes('--check')) {
  if (readFileSync(target, 'utf8') !== text) {
    console.error('src/schema.ts is not that of schema.json; run: npm run types')
    process.exit(1)
  }
} else writeFileSync(target, text)
