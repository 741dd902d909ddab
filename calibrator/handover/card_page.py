"""A material card as one self-contained page, in the style of the report."""

from __future__ import annotations

from collections.abc import Sequence

from calibrator.case.vocabulary import PARAMETERS, PLAIN_UNITS, QUANTITIES
from calibrator.handover.card import Card, CardValue, Compared, Member
from calibrator.report.html import mark, note, page, paragraph, section, table
from calibrator.report.words import in_unit, key_words, number, text, unit, with_error, words


def card_page(card: Card) -> str:
    """The page."""
    kind = "" if card.verified else "alarm"
    head = (
        f"<header><h1>Material card: {text(words(card.name))}</h1>"
        f"{paragraph(text(card.about), 'about')}{paragraph(text(card.standing), kind)}"
        f"{note(_origin(card))}</header>"
    )
    parts = (_values, _scope, _compared, _family, _vessels, _provenance)
    return page(f"Material card of {card.name}", [head, *(part(card) for part in parts)])


def _origin(card: Card) -> str:
    """Which parameter set it is, and whether its laboratory is real."""
    lab = " The laboratory is synthetic: simulations at known parameters." * (
        card.provenance.synthetic
    )
    held = {True: "passed", False: "not passed by every response", None: "not made"}
    validated = f" Validation on what was held out: {held[card.validated]}."
    return f"Parameter set: {card.candidate} of the calibration.{validated}{lab}"


def _values(card: Card) -> str:
    rows = [
        [
            text(words(v.name)) + _unit(v),
            text(v.symbol),
            _shown(v),
            text(v.interval),
            " to ".join(map(number, v.searched or (None,))),
            mark(v.pinned, "yes", "no"),
            text(v.about),
        ]
        for v in card.values
    ]
    head = ["parameter", "symbol", "value", "95 % interval", "searched", "pinned down", "meaning"]
    return section("Values", table("Parameters of the contact, in SI units", head, rows, 2))


def _unit(value: CardValue) -> str:
    """The unit in brackets; a word has none."""
    return "" if value.unit in PLAIN_UNITS else in_unit(PARAMETERS[value.name])


def _shown(value: CardValue) -> str:
    return text(value.value) if isinstance(value.value, str) else number(value.value)


def _scope(card: Card) -> str:
    return section(
        "What it is for",
        "<h3>Valid for</h3>" + _listed(_spoken(card, card.valid_for)),
        "<h3>Not calibrated for</h3>" + _listed(_spoken(card, card.not_calibrated_for)),
    )


def _spoken(card: Card, sentences: Sequence[str]) -> list[str]:
    """The sentences with the card's names in words."""
    names = {r.key: key_words(r.key) for r in card.compared}
    names |= {v.name: words(v.name) for v in card.values}
    said = []
    for sentence in sentences:
        for name, plain in names.items():
            sentence = sentence.replace(name, plain)
        said.append(sentence)
    return said


def _listed(sentences: Sequence[str]) -> str:
    """A list, an item for each sentence."""
    return f"<ul>{''.join(f'<li>{text(s)}</li>' for s in sentences)}</ul>"


def _compared(card: Card) -> str:
    head = [
        "response",
        "role",
        "measured",
        "scatter",
        "repeats",
        "promised",
        "fresh runs",
        "of them",
        "verdict",
    ]
    caption = (
        "Measured, promised by the interpolant, and the mean of fresh YADE runs (standard errors)"
    )
    rows = [_row(c) for c in card.compared]
    return section("Calibrated, verified and validated on", table(caption, head, rows))


def _row(one: Compared) -> list[str]:
    quantity = QUANTITIES[one.key.split(".")[1]]
    sign = f" {text(unit(quantity))}" if unit(quantity) else ""
    return [
        text(key_words(one.key)),
        text(one.role.replace("_", " ")),
        number(one.measured) + sign,
        number(one.scatter or None),
        str(one.replicates),
        _mean(one.predicted, one.predicted_error),
        _mean(one.simulated, one.standard_error),
        str(one.runs),
        text(one.verdict),
    ]


def _mean(value: float | None, error: float | None) -> str:
    """A mean with its standard error; a dash where there is none."""
    if value is None or error is None:
        return number(value)
    if error < 1e-2:  # as of a rate in kg/s, which has no digits before the point
        return f"{number(value)} ± {number(error, 2)}"
    return with_error(value, error)


def _family(card: Card) -> str:
    names = list(card.family[0].parameters)
    head = ["set", *(text(words(n)) + in_unit(PARAMETERS[n]) for n in names), "verified"]

    def row(member: Member) -> list[str]:
        return [
            text(member.label),
            *(number(member.parameters[n]) for n in names),
            mark(member.verified, "yes", "no"),
        ]

    caption = "Sets that the targets cannot tell apart, or trade against cost"
    rows = map(row, card.family)
    return section(
        "The family of equivalent sets", table(caption, head, rows), note(card.family_note)
    )


def _vessels(card: Card) -> str:
    rows = [
        [
            text(words(v.setup)),
            text(v.used_for),
            text(", ".join(f"{words(n)} = {_given(n, x)}" for n, x in v.parameters.items())),
        ]
        for v in card.vessels
    ]
    return section(
        "Set-ups", table("Vessels of the measurements", ["set-up", "used for", ""], rows)
    )


def _given(name: str, value: float | int | str) -> str:
    """A parameter of a set-up with its unit."""
    sign = unit(PARAMETERS[name])
    return f"{value if isinstance(value, str) else number(value)}{' ' + sign if sign else ''}"


def _provenance(card: Card) -> str:
    p = card.provenance
    runs = ", ".join(f"{n} {kind}" for kind, n in p.runs.items())
    rows = [
        ["calibrator", text(p.calibrator)],
        ["YADE", text(", ".join(p.yade) or "not recorded")],
        ["case file", f"{text(p.case)}<br><code>{text(p.case_sha256)}</code>"],
        ["laboratory", f"{text(p.laboratory)}<br><code>{text(p.laboratory_sha256)}</code>"],
        ["runs of the plan", f"{text(runs)} ({text(p.design)} design)"],
    ]
    commands = "\n".join(card.reproduce)
    cited = _listed(card.citation.text) + f"<pre>{text(card.citation.bibtex.strip())}</pre>"
    return section(
        "Provenance",
        table("Versions, files with their SHA-256, runs", ["", ""], rows),
        f"<h3>Made again by</h3><pre>{text(commands)}</pre>",
        f"<h3>To be cited</h3>{cited}",
    )
