"""A tree as text and as a plot."""

import math
from typing import TYPE_CHECKING

from rsrl.drawing import CALL_COLOURS, CALL_INKS, INK
from rsrl.drawing.style import SOFT
from rsrl.explanation.tree.path import whole_number, with_unit
from rsrl.state import Action
from rsrl.strategists import Tree, TreeColumn, describe
from rsrl.strategists.tree.tree import LEAF

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def question(column: TreeColumn, threshold: float) -> tuple[str, str, str]:
    """The question of a node, and its answers for values at most the threshold and above it."""
    if column.category:
        return column.text.rpartition(":")[0], f"not {column.category}", column.category
    if column.kind == "boolean":
        return column.text, "no", "yes"
    if column.whole:
        at = math.floor(threshold)
        return column.text, f"at most {whole_number(at, column.unit)}", f"at least {whole_number(at + 1, column.unit)}"
    number = with_unit(f"{threshold:.4g}", column.unit)
    return column.text, f"at most {number}", f"above {number}"


def leaf_words(tree: Tree, node: int) -> str:
    """A leaf's call, and in how many of its states the policy made it."""
    there = tree.samples[node]
    return f"{Action(int(tree.action[node]))} ({int(there[tree.action[node]])} of {int(there.sum())})"


def tree_text(tree: Tree) -> str:
    """The tree as indented text, a line a branch."""
    lines = [f"{tree.model} at {tree.race} for {tree.driver}: {len(tree.leaves)} leaves, depth {tree.depth}"]
    waiting = [(0, 0, "")]
    while waiting:
        node, depth, said = waiting.pop()
        indent = "|  " * max(depth - 1, 0) + ("|- " if depth else "")
        if tree.feature[node] == LEAF:
            lines.append(f"{indent}{said}-> {leaf_words(tree, node)}")
            continue
        if said:
            lines.append(f"{indent}{said.removesuffix(' ')}")
        text, most, above = question(describe(tree.columns[tree.feature[node]]), float(tree.threshold[node]))
        waiting.append((int(tree.right[node]), depth + 1, f"{text}: {above} "))
        waiting.append((int(tree.left[node]), depth + 1, f"{text}: {most} "))
    return "\n".join(lines)


def plot_tree(tree: Tree, ax: "Axes | None" = None, *, max_depth: int = 4) -> "Axes":
    """The top of the tree: one box a node, leaves coloured by call; a branch cut at `max_depth` shows the commonest call of its states."""
    import matplotlib.pyplot as plt

    places = _places(tree, max_depth)
    width = max(x for x, _ in places.values()) + 1
    axes = plt.subplots(figsize=(max(2.0 * width, 6), 1.4 * (max_depth + 1)), layout="constrained")[1] if ax is None else ax
    for node, (x, y) in places.items():
        cut = tree.feature[node] == LEAF or y == -max_depth
        if cut:
            words = leaf_words(tree, node).replace(" (", "\n(")
        else:
            text, most, above = question(describe(tree.columns[tree.feature[node]]), float(tree.threshold[node]))
            words = _wrapped(text)
            for child, answer in ((int(tree.left[node]), most), (int(tree.right[node]), above)):
                there = places[child]
                axes.plot((x, there[0]), (y, there[1]), color=SOFT, linewidth=0.8, zorder=1)
                axes.text(
                    (x + there[0]) / 2, (y + there[1]) / 2, answer, fontsize=6, ha="center", va="center", zorder=2, backgroundcolor="white"
                )
        call = int(tree.action[node])
        colour, ink = (CALL_COLOURS[call], CALL_INKS[call]) if cut else ("#ffffff", INK)
        box = {
            "boxstyle": "round",
            "facecolor": colour,
            "edgecolor": SOFT,
            "linestyle": "-" if tree.feature[node] == LEAF or not cut else "--",
        }
        axes.text(x, y, words, fontsize=6, color=ink, ha="center", va="center", bbox=box, zorder=3)
    axes.set_xlim(-0.7, width - 0.3)
    axes.set_ylim(-max_depth - 0.5, 0.5)
    axes.axis("off")
    axes.set_title(f"{tree.model} at {tree.race}, {tree.driver}: a tree of {len(tree.leaves)} leaves", loc="left", fontsize=9)
    return axes


def _places(tree: Tree, max_depth: int) -> dict[int, tuple[float, float]]:
    """Position of each shown node: leaves side by side, others above the middle of their branches."""
    places: dict[int, tuple[float, float]] = {}
    ends = 0

    def place(node: int, depth: int) -> float:
        nonlocal ends
        if tree.feature[node] == LEAF or depth == max_depth:
            x, ends = float(ends), ends + 1
        else:
            x = (place(int(tree.left[node]), depth + 1) + place(int(tree.right[node]), depth + 1)) / 2
        places[node] = (x, float(-depth))
        return x

    place(0, 0)
    return places


def _wrapped(text: str, width: int = 22) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text, width))
