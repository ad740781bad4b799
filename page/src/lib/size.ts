// Charts do not follow the size of what they are in by themselves.
export function onSize(node: HTMLElement, sized: (width: number, height: number) => void): () => void {
  const tell = (): void => sized(Math.max(node.clientWidth, 10), Math.max(node.clientHeight, 10))
  const watch = new ResizeObserver(tell)
  tell()
  watch.observe(node)
  return () => watch.disconnect()
}
