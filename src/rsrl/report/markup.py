"""HTML as values: an element escapes what it is given unless that is markup already, so no text of a file can become a tag."""

from collections.abc import Iterable
from html import escape
from typing import Final

VOID: Final = frozenset({"br", "col", "meta"})
"""Elements of HTML without content, of those used here."""


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


Child = str | Iterable["str"]
Attribute = str | int | float | bool | None


def element(name: str, /, *children: Child, **attributes: Attribute) -> Markup:
    """An element of HTML or SVG.

    Args:
        name: of the element.
        children: text, which is escaped, `Markup`, which is not, or several of them.
        attributes: `class_` is `class`, `aria_label` is `aria-label`; None and False are left out, True is a name alone.
    """
    start = f"<{name}{''.join(_attribute(key, value) for key, value in attributes.items())}>"
    return Markup(start) if name in VOID else Markup(f"{start}{together(*children)}</{name}>")


def together(*children: Child) -> Markup:
    """Texts and markup one after the other, texts escaped."""
    return Markup("".join(_safe(child) for child in children))


def unseen(text: str) -> Markup:
    """What is read aloud and not shown."""
    return element("span", text, class_="unseen")


def _safe(child: Child) -> str:
    if isinstance(child, Markup):
        return child
    if isinstance(child, str):
        return escape(child)
    return "".join(_safe(part) for part in child)


def _attribute(key: str, value: Attribute) -> str:
    if value is None or value is False:
        return ""
    name = key.rstrip("_").replace("_", "-")
    if value is True:
        return f" {name}"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f' {name}="{escape(text)}"'
