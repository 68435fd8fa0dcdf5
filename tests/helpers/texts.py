"""What tests read of reports and other output."""

import re
from html import unescape


def one_line(text: str) -> str:
    """The text without line breaks and indents."""
    return " ".join(text.split())


def row(text: str, first: str) -> list[str]:
    """Cells of the first table row that starts with this cell."""
    return next(line.split() for line in text.splitlines() if line.split()[:1] == [first])


def page_text(page: str) -> str:
    """The text of a page, a line for each row and paragraph; without scripts, drawings and versions of packages."""
    text = re.sub(r"<(script|style|svg)\b.*?</\1>", "", page, flags=re.DOTALL)
    text = re.sub(r"\s*<t[dh]\b[^>]*>", "  ", text.replace("<br>", " ").replace("\n", " \n"))
    text = unescape(re.sub(r"<[^>]*>", "\n", re.sub(r"</t[dh]>", "", text)))
    lines = (line.strip() for line in text.split("\n"))
    return (
        "\n".join(line for line in lines if line and not line.startswith(("Versions:", "Written by"))) + "\n"
    )
