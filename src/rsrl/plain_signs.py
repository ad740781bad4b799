"""Plain signs for an output stream whose encoding lacks box characters, arrows or accents, such as a file under a Windows code page."""

import unicodedata
from typing import Final

PLAIN: Final = {
    "─": "-", "━": "=", "│": "|", "█": "#", "▏": "|", "→": "->", "←": "<-", "↑": "^", "↓": "v", "−": "-", "–": "-", "—": "-", "±": "+-",
    "×": "x", "·": "*", "•": "*", "…": "...", "≤": "<=", "≥": ">=", "≠": "!=", "≈": "~", "°": " deg",
    "‘": "'", "’": "'", "“": '"', "”": '"',
}  # fmt: skip
"""What stands for a sign that a stream cannot have."""


def has_signs(encoding: str, text: str) -> bool:
    """Whether an encoding has every character of a text."""
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        return False
    return True


def plain_signs(text: str, encoding: str) -> str:
    """The text with every character that the encoding lacks replaced: signs as in `PLAIN`, accented letters by bare ones, else `?`."""
    if has_signs(encoding, text):
        return text
    return "".join(sign if has_signs(encoding, sign) else PLAIN.get(sign) or _bare(sign) for sign in text)


def _bare(letter: str) -> str:
    return unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode("ascii") or "?"
