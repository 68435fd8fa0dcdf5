"""Characters that a terminal or a reader of text would act on, instead of showing them."""

from __future__ import annotations

import re

# Control characters (C0, DEL, C1: among them ESC, NUL and the ends of rows), the two line separators, marks and
# controls of writing direction, which reorder the text around them, and lone surrogates: the bytes of file names that
# are no UTF-8.
HIDDEN = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


def visible(text: str) -> str:
    r"""`text` with each of these characters as an escape such as \x1b or \u202e; ends of rows and tabs stay."""
    return HIDDEN.sub(lambda match: match[0] if match[0] in "\n\t" else escaped(match[0]), text)


def escaped(character: str) -> str:
    """The escape of a character in Python and TOML: \\x1b, \\u202e."""
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"
