"""A surrogate tree as one HTML page that needs no other file: branches fold, the path of a decision stands open."""

from typing import Final

import numpy as np

from rsrl.drawing import CALL_COLOURS, CALL_INKS
from rsrl.explanation.tree.draw import leaf_words, question
from rsrl.report.markup import Markup, element
from rsrl.strategists import Tree, describe
from rsrl.strategists.tree.tree import LEAF

STYLE: Final = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #1d2329; }
details { margin-left: 1.1rem; border-left: 1px solid #c9ced4; padding-left: .6rem; }
summary { cursor: pointer; }
.answer { color: #5a636d; }
.leaf { padding: .1rem .5rem; border-radius: .3rem; display: inline-block; border: 1px solid #c9ced4; color: #1d2329; }
.path > summary, .leaf.path { font-weight: 600; outline: 2px solid #1b7f5c; outline-offset: 1px; }
"""
OPEN_DEPTH: Final = 2
"""Levels that stand open where no decision is marked."""


def tree_page(tree: Tree, row: np.ndarray | None = None) -> str:
    """The page of a tree.

    Args:
        row: a decision's row of the tree, float32 [C], whose path is marked and stands open.
    """
    title = f"Tree of {tree.model} at {tree.race}, {tree.driver}"
    about = (
        f"{len(tree.leaves)} leaves, depth {tree.depth}. The tree imitates the policy with weights hash {tree.model_hash}. "
        "The numbers of a leaf say how many of its states the policy called the same way, out of how many in the fitting races."
    )
    head = element("head", element("meta", charset="utf-8"), element("title", title), element("style", Markup(STYLE)))
    body = element("body", element("h1", title), element("p", about), _node(tree, 0, "", 0, _path(tree, row)))
    return f"<!doctype html>\n{element('html', head, body, lang='en')}\n"


def _path(tree: Tree, row: np.ndarray | None) -> frozenset[int]:
    """Nodes that a row comes through; none without a row."""
    if row is None:
        return frozenset()
    nodes = [0]
    for condition in tree.path(row):
        nodes.append(int(tree.left[nodes[-1]] if condition.at_most else tree.right[nodes[-1]]))
    return frozenset(nodes)


def _node(tree: Tree, node: int, answer: str, depth: int, path: frozenset[int]) -> Markup:
    """A node with all below it; `answer` is the answer to its parent's question that leads here."""
    before = [element("span", answer, class_="answer"), " "] if answer else ""
    marked = " path" if node in path else ""
    if tree.feature[node] == LEAF:
        call = int(tree.action[node])
        style = f"background:{CALL_COLOURS[call]};color:{CALL_INKS[call]}"
        return element("div", before, element("span", leaf_words(tree, node), class_=f"leaf{marked}", style=style))
    text, most, above = question(describe(tree.columns[tree.feature[node]]), float(tree.threshold[node]))
    children = zip((tree.left[node], tree.right[node]), (most, above), strict=True)
    opened = bool(marked) or (depth < OPEN_DEPTH and not path)
    return element(
        "details",
        element("summary", before, f"{text}?"),
        [_node(tree, int(child), said, depth + 1, path) for child, said in children],
        class_=f"node{marked}",
        open=opened,
    )
