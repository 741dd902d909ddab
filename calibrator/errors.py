"""The exceptions that users are meant to see, and how values are shown in them."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterable, Iterator

# characters of a message; what is cut out lies before the remedy, which stands at the end
LONGEST = 1000
MOST_LINES = 20  # of one error; somebody with more mistakes than that mends these first


class CalibratorError(Exception):
    """Something the user can mend.

    The message is one line, whatever was put into it, and ends with what to do. Where several
    things are wrong at once it is their number, and then a line for each (see `Mistakes`).
    """

    def __init__(self, *messages: str) -> None:
        self.messages: tuple[str, ...] = tuple(map(one_line, messages))
        shown = [f"  {message}" for message in self.messages[:MOST_LINES]]
        if (more := len(self.messages) - len(shown)) > 0:
            shown.append(f"  and {more} more: mend these first, then call again")
        several = [f"{len(self.messages)} mistakes:", *shown]
        super().__init__(self.messages[0] if len(self.messages) == 1 else "\n".join(several))


@dataclasses.dataclass(eq=False)
class DryRun(Exception):
    """What a verb would do next in a dry run, which ends there.

    runs : that would be made, on an engine; core_hours : predicted; refused : why they would not be
    made after all, "" where they would.
    """

    runs: int
    core_hours: float
    engine: str
    refused: str

    def lines(self) -> list[str]:
        """The same in plain words."""
        where = {"local": "on this machine"}.get(self.engine, f"on {self.engine}")
        said = (
            f"would make {self.runs} runs {where}, {self.core_hours:.2g} core-hours; none is made"
        )
        return [said, *([f"  it would be refused: {self.refused}"] if self.refused else [])]


class Mistakes:
    """Collects what is wrong, so that a user can mend it all before the next call.

    >>> mistakes = Mistakes()
    >>> for name in ("density", "radius"):
    ...     with mistakes.noted():
    ...         raise CalibratorError(f"{name} is missing: add it")
    >>> mistakes.raise_any()
    Traceback (most recent call last):
        ...
    calibrator.errors.CalibratorError: 2 mistakes:
      density is missing: add it
      radius is missing: add it
    """

    def __init__(self) -> None:
        self.messages: dict[str, None] = {}  # in order, each once

    @contextlib.contextmanager
    def noted(self) -> Iterator[None]:
        """Note the CalibratorError that the body may raise, and go on."""
        try:
            yield
        except CalibratorError as error:
            self.note(error.messages)

    def note(self, messages: Iterable[str]) -> None:
        """Note messages."""
        self.messages.update(dict.fromkeys(messages))

    def raise_any(self) -> None:
        """Raise CalibratorError with all that was noted, if anything was."""
        if self.messages:
            raise CalibratorError(*self.messages)


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
