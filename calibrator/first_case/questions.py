"""The questions of `init` on a terminal, for those who have no file of answers."""

from __future__ import annotations

from collections.abc import Callable

from calibrator.case.codec import Table
from calibrator.case.vocabulary import PARAMETERS, RESPONSES, SETUPS
from calibrator.errors import CalibratorError
from calibrator.first_case.answers import BUDGET, KEYS, REQUIRED, VESSELS, answers_of
from calibrator.first_case.grains import SHAPES

ASKED = {
    "conical_pile": ("bulk_density", "pile_angle_of_repose_deg", "pile_equivalent_angle_deg"),
    "ledge": ("bulk_density", "ledge_angle_of_repose_deg", "ledge_equivalent_angle_deg"),
    "hourglass": ("bulk_density", "mass_flow_rate", "drained_angle_of_repose_deg"),
    "rotating_drum": ("drum_angle_deg", "drum_upper_angle_deg", "drum_lower_angle_deg"),
}
"""Responses that are asked for; a lab file may have others."""
IN_WORDS = {
    "conical_pile": "a heap from a lifted cylinder",
    "ledge": "a slope in a box whose front is dropped",
    "hourglass": "the flow through a neck, or a drained cylinder",
    "rotating_drum": "the surface in a rotating drum",
}
Ask = Callable[[str], str]
Say = Callable[[str], None]


def ask_all(ask: Ask, say: Say) -> Table:
    """The table of answers; asks again where an answer is wrong.

    ask : returns what is typed after a prompt; say : prints a line.
    """
    say("An empty line skips a question that may be skipped. Give units: 2 mm, 1.53 g/cm3, 12 g/s.")
    table: Table = {}
    for key in (*REQUIRED, "budget", "lab"):
        words = f"{key} ({KEYS[key]})"
        if key == "shape":
            words = "shape (" + "; ".join(f"{n}: {g.about}" for n, g in SHAPES.items()) + ")"
        usual = {"budget": f"{BUDGET:g}", "lab": ""}.get(key)
        if value := _one(ask, say, words, key, table, usual):
            table[key] = value
    for setup in SETUPS:
        if ask(f"Did you measure {IN_WORDS[setup]}? [y/N] ").strip().lower()[:1] == "y":
            table[setup] = _set_up(ask, say, setup)
    return table


def _one(ask: Ask, say: Say, words: str, key: str, table: Table, usual: str | None) -> str:
    """One answer at the top of the table."""
    while True:
        value = ask(f"{words}{f' [{usual}]' if usual else ''}: ").strip() or (usual or "")
        if not value and usual is not None:
            return ""
        if wrong := _wrong({**table, key: value}, key):
            say(f"  {wrong}")
            continue
        return value


def _set_up(ask: Ask, say: Say, setup: str) -> Table:
    """Vessel and measurements of a set-up."""
    own: Table = {"measured": {}}
    for name in VESSELS[setup]:
        while not (value := ask(f"  {PARAMETERS[name].about}: ").strip()) or (
            wrong := _wrong({setup: {name: value}}, f"{name} =")
        ):
            say(f"  {wrong if value else 'give a number and its unit'}")
        own[name] = value
    for response in ASKED[setup]:
        about = RESPONSES[response].about
        while value := ask(f"  {about}; repeats between semicolons: ").strip():
            if not (wrong := _wrong({setup: {"measured": {response: value}}}, response)):
                own["measured"][response] = value
                break
            say(f"  {wrong}")
    return own


def _wrong(table: Table, key: str) -> str:
    """What is wrong with the answer to `key`, as far as the table tells; "" where nothing is."""
    try:
        answers_of(table)
    except CalibratorError as error:
        others = ("is missing", "nothing was measured")
        own = [m for m in error.messages if key in m and not any(o in m for o in others)]
        return own[0] if own else ""
    return ""
