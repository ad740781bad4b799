"""Reading text that other programs wrote: UTF-8 with or without the byte order mark that Windows puts first, or UTF-16 with one."""

import codecs
from pathlib import Path


def decode_text(raw: bytes) -> str:
    """The text of a file's bytes, without a byte order mark. PowerShell writes UTF-16 with one; without one the text is UTF-8.

    Raises:
        UnicodeDecodeError: the bytes are no such text.
    """
    utf16 = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return raw.decode("utf-16" if utf16 else "utf-8-sig")


def read_text(path: Path) -> str:
    """The text of a file, as `decode_text`. Raises OSError and UnicodeDecodeError."""
    return decode_text(path.read_bytes())
