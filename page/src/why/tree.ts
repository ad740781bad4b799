// The tree's nodes laid out for drawing.
export interface Nodes {
  feature: string[]
  threshold: number[]
  left: number[]
  right: number[]
  call: string[]
  /** Of each node, how many states made each call. */
  samples: number[][]
}

export interface Placed {
  node: number
  x: number
  depth: number
  parent: Placed | null
  leaf: boolean
}

const lists: (keyof Nodes)[] = ['feature', 'threshold', 'left', 'right', 'call', 'samples']

export function nodesOf(details: Record<string, unknown>): Nodes | null {
  const tree = details.tree as Nodes | undefined
  return tree && lists.every((name) => Array.isArray(tree[name])) ? tree : null
}

/** Leaves side by side, each parent over the middle of its children. */
export function layout(nodes: Nodes): Placed[] {
  const placed: Placed[] = []
  let next = 0
  const visit = (node: number, depth: number, parent: Placed | null): Placed => {
    const leaf = nodes.left[node]! < 0
    const own: Placed = { node, x: 0, depth, parent, leaf }
    placed.push(own)
    if (leaf) own.x = next++
    else {
      const left = visit(nodes.left[node]!, depth + 1, own)
      const right = visit(nodes.right[node]!, depth + 1, own)
      own.x = (left.x + right.x) / 2
    }
    return own
  }
  visit(0, 0, null)
  return placed
}

export interface Bounds {
  feature: string
  lower: number | null
  upper: number | null
}

/** Nodes on the way of a state of which the questions give the bounds. */
export function pathOf(nodes: Nodes, bounds: readonly Bounds[]): Set<number> {
  const of = new Map(bounds.map((one) => [one.feature, one]))
  const path = new Set<number>()
  for (let node = 0; node >= 0 && !path.has(node); ) {
    path.add(node)
    const bound = of.get(nodes.feature[node] ?? '')
    if (nodes.left[node]! < 0 || !bound) break
    // thresholds come rounded to four digits
    const below = bound.upper !== null && bound.upper <= nodes.threshold[node]! + 1e-4
    node = (below ? nodes.left[node] : nodes.right[node])!
  }
  return path
}
