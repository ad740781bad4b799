"""A tree as one HTML page that needs nothing else: branches fold, the way of a decision stands open."""

from collections.abc import Mapping
from html import escape
from typing import Any, Final

import numpy as np

from rsrl.explanation.tree.draw import COLOURS, leaf_words, question
from rsrl.state import ACTION_NAMES, Action
from rsrl.strategists import Tree, describe
from rsrl.strategists.tree.tree import LEAF

_STYLE: Final = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #1d2329; }
details { margin-left: 1.1rem; border-left: 1px solid #c9ced4; padding-left: .6rem; }
summary { cursor: pointer; }
.answer { color: #5a636d; }
.leaf { padding: .1rem .5rem; border-radius: .3rem; display: inline-block; border: 1px solid #c9ced4; color: #1d2329; }
.way > summary, .leaf.way { font-weight: 600; outline: 2px solid #1b7f5c; outline-offset: 1px; }
table { border-collapse: collapse; }
td, th { padding: .1rem .8rem .1rem 0; text-align: right; }
th:first-child, td:first-child { text-align: left; }
"""
_OPEN_DEPTH: Final = 2


def tree_page(tree: Tree, row: np.ndarray | None = None, figures: Mapping[str, Any] | None = None) -> str:
    """The page.

    Args:
        row: a decision's row float32 [C], whose way is marked and stands open.
        figures: what `measure_tree` found, for its table.
    """
    title = f"Tree of {tree.model} at {tree.race}, {tree.driver}"
    way = _way(tree, row) if row is not None else frozenset()
    body = [
        f"<h1>{escape(title)}</h1>",
        f"<p>{len(tree.leaves)} leaves, depth {tree.depth}. It stands for the policy of hash {escape(tree.model_hash)}. Each answer says "
        "in how many of its states in fitting races the policy called the same.</p>",
        tree_markup(tree, way),
    ]
    if figures:
        body.append(_figures_table(figures))
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    return f'<!doctype html><html lang="en"><head>{head}</head><body>{"".join(body)}</body></html>\n'


def tree_markup(tree: Tree, way: frozenset[int] = frozenset()) -> str:
    """The tree alone, as nested HTML, for a page of one's own; nodes of `way` are marked."""
    return _node(tree, 0, "", 0, way)


def _way(tree: Tree, row: np.ndarray) -> frozenset[int]:
    nodes = [0]
    for condition in tree.path(row):
        nodes.append(int(tree.left[nodes[-1]] if condition.at_most else tree.right[nodes[-1]]))
    return frozenset(nodes)


def _node(tree: Tree, node: int, answer: str, depth: int, way: frozenset[int]) -> str:
    before = f'<span class="answer">{escape(answer)}</span> ' if answer else ""
    marked = " way" if node in way else ""
    if tree.feature[node] == LEAF:
        colour = COLOURS[int(tree.action[node])]
        return f'<div>{before}<span class="leaf{marked}" style="background:{colour}">{escape(leaf_words(tree, node))}</span></div>'
    text, most, above = question(describe(tree.columns[tree.feature[node]]), float(tree.threshold[node]))
    inside = _node(tree, int(tree.left[node]), most, depth + 1, way) + _node(tree, int(tree.right[node]), above, depth + 1, way)
    opened = " open" if marked or (depth < _OPEN_DEPTH and not way) else ""
    return f'<details class="node{marked}"{opened}><summary>{before}{escape(text)}?</summary>{inside}</details>'


def _figures_table(figures: Mapping[str, Any]) -> str:
    """The main figures of a measurement beside the paper's, and the confusion matrix."""
    labels, paper = figures["labels"], figures["paper"]
    rows = [
        ("accuracy", labels["accuracy"], paper["accuracy"]),
        ("accuracy of never stopping", labels["majority"], paper["majority"]),
        ("macro-F1", labels["macro_f1"], paper["macro_f1"]),
        ("kappa", labels["kappa"], paper["kappa"]),
        ("stops on the very lap, any compound", figures["stops"]["any_compound_on_the_lap"]["value"], paper["stops_found"]),
        ("right compound within one lap", figures["stops"]["within_one_lap"]["value"], None),
        ("places behind the policy when it drives", figures["behind_policy"]["value"], None),
    ]
    lines = "".join(f"<tr><td>{escape(name)}</td><td>{_cell(here)}</td><td>{_cell(there)}</td></tr>" for name, here, there in rows)
    names = "".join(f"<th>{escape(str(Action(i)))}</th>" for i in range(len(ACTION_NAMES)))
    matrix = "".join(
        f"<tr><td>{escape(str(Action(i)))}</td>{''.join(f'<td>{count:,}</td>' for count in line)}</tr>"
        for i, line in enumerate(labels["confusion"])
    )
    return (
        f"<h2>How well it stands for the policy</h2><table><tr><th></th><th>here</th><th>the paper's</th></tr>{lines}</table>"
        f"<h2>The policy's calls (rows) and the tree's (columns)</h2><table><tr><th></th>{names}</tr>{matrix}</table>"
    )


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"
