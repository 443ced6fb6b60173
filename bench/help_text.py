"""Parts of the help that several commands share."""


def block(title: str, *lines: str) -> str:
    """Return lines for the end of a help text, kept as they are."""
    return "\n".join(["\b", f"{title}:", *(f"  {line}" for line in lines)])
