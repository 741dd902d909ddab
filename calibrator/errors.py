"""The one exception that users are meant to see, and how values are shown in it."""

from __future__ import annotations

# characters of a message; what is cut out lies before the remedy, which stands at the end
LONGEST = 1000


class CalibratorError(Exception):
    """Something the user can mend.

    The message is one line, whatever was put into it, and ends with what to do.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def one_line(text: str) -> str:
    """The text without line breaks, control characters and lone surrogates.

    Its middle is cut out where it is very long.
    """
    text = str(text)
    if len(text) > LONGEST:
        text = f"{text[: LONGEST // 2]} ... {text[-LONGEST // 2 :]}"
    return "".join(c if c.isprintable() else " " if c.isspace() else repr(c)[1:-1] for c in text)


def shown(value: object) -> str:
    """What a user gave, as repr shows it, shortened.

    Some values, such as an integer of 5000 digits, have no repr; these are named by their type.
    """
    try:
        text = repr(value)
    except (ValueError, RecursionError):
        return f"<{type(value).__name__} too large to show>"
    return text if len(text) <= 100 else f"{text[:70]} ... {text[-20:]}"
