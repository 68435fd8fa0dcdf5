"""What tests read of reports and other output."""


def one_line(text: str) -> str:
    """The text without line breaks and indents."""
    return " ".join(text.split())


def row(text: str, first: str) -> list[str]:
    """Cells of the first table row that starts with this cell."""
    return next(line.split() for line in text.splitlines() if line.split()[:1] == [first])
