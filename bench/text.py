"""Names from elsewhere as text that no terminal, browser or parser takes for an instruction."""

# A name that is longer is cut where it is shown.
LONGEST = 120


def visible(text: str) -> str:
    """Return one line in which whatever does not print is written as an escape, as in Python."""
    spaced = " ".join(text.split())
    if spaced.isprintable():
        return spaced
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode()
        for letter in spaced
    )


def shortened(text: str, length: int = LONGEST) -> str:
    """Return the text, its end cut off if it is longer."""
    return text if len(text) <= length else f"{text[: length - 1]}…"
