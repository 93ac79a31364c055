"""Numbers with their nouns."""


def several(count: int, noun: str) -> str:
    """A number in digits with its noun: '1 video', '12 videos'."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
