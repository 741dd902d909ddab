"""The verb `card`: a material card as JSON, and as one page."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from calibrator import __version__
from calibrator.case.codec import Table, plain, schema_of
from calibrator.case.fingerprint import changed
from calibrator.case.problem import Target
from calibrator.case.vocabulary import PARAMETERS, QUANTITIES
from calibrator.files import own_folder, read_bytes, write_text
from calibrator.handover.card import (
    CITATION,
    VERSION,
    Card,
    CardValue,
    Compared,
    Provenance,
    Vessel,
)
from calibrator.handover.card_page import card_page
from calibrator.handover.chosen import CONTACT, Chosen, chosen, shared, verdict_of
from calibrator.handover.family import family, note
from calibrator.handover.scope import not_calibrated_for, valid_for
from calibrator.plan.run import with_curves
from calibrator.runs.workspace import Workspace, for_new_seeds
from calibrator.search.outcome import COMPROMISE, Calibration, current_calibration
from calibrator.search.parts import ParameterProfile, Promise
from calibrator.verification.outcome import Validation, Verdict
from calibrator.verification.verify import (
    validation_requests,
    validation_rests_on,
    with_held_out_curves,
)


@dataclass(frozen=True)
class CardWritten:
    """Outcome of the verb `card`: the card, its page, and how far the material was verified."""

    candidate: str
    verified: bool | None
    standing: str
    card: Path
    page: Path

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        return [f"{self.candidate}, {self.standing}", f"  {self.card}", f"  {self.page}"]


def schema() -> Table:
    """JSON schema (draft 2020-12) of a card."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "card of a calibrated material",
        **schema_of(Card),
    }


def write_card(space: Workspace, candidate: str = "", out: Path | None = None) -> CardWritten:
    """Write the card of a calibrated material, and its page.

    Parameters
    ----------
    candidate : label of a member of the front; the compromise unless one is named.
    out : folder of the two files; that of the results unless one is given, where they are called
        card.json and card.html, elsewhere by the material's name.

    Raises
    ------
    CalibratorError, with what to do, where the calibration is missing or stale, or has no such
    candidate.
    """
    card, one = make_card(space, candidate), chosen(space, candidate)
    folder = space.folder() if out is None else own_folder(out)
    stem = one.stem if out is not None else "card"
    paths = folder / f"{stem}.json", folder / f"{stem}.html"
    write_text(paths[0], json.dumps(plain(card), indent=1, ensure_ascii=False) + "\n")
    write_text(paths[1], card_page(card))
    done = CardWritten(one.label, card.verified, one.standing.here(space), *paths)
    return space.note("card", done)


def make_card(space: Workspace, candidate: str = "") -> Card:
    """The card of a candidate; see `write_card`."""
    space = with_curves(space)
    one, found = chosen(space, candidate), current_calibration(space)
    verified, (space, validated) = _verified(space, found), _validated(space, found)
    own, held = verified.get(one.label), validated.get(one.label)
    problem, promised = space.case.problem, found.candidates[one.label].predicted
    compared = (
        *(_compared(t, "calibrate", own, promised.get(t.key)) for t in problem.targets),
        *(_compared(t, "held_out", held) for t in problem.held_out),
    )
    return Card(
        version=VERSION,
        name=one.case,
        about=one.about,
        candidate=one.label,
        verified=one.standing.passed,
        validated=held.passed if held else None,
        standing=one.standing.sentence,
        values=_values(one, found),
        family=family(problem, found, one.label, verified),
        family_note=note(problem, found),
        compared=compared,
        vessels=_vessels(space),
        valid_for=valid_for(one, compared),
        not_calibrated_for=not_calibrated_for(one, found, compared),
        provenance=_provenance(space, found),
        reproduce=(shared(space, "all"), shared(space, "card")),
        citation=CITATION,
    )


def _verified(space: Workspace, found: Calibration) -> dict[str, Verdict]:
    """Verdicts of the verification by candidate, where it counts."""
    verdicts = {label: verdict_of(space, found, label) for label in found.candidates}
    return {label: v for label, v in verdicts.items() if isinstance(v, Verdict)}


def _validated(space: Workspace, found: Calibration) -> tuple[Workspace, dict[str, Verdict]]:
    """The workspace that a validation is of, and its verdicts by candidate.

    There are no verdicts where there is no validation, or a stale one.
    """
    noted = space.outcome("validate", Validation)
    if noted is None:
        return space, {}
    afresh = for_new_seeds(space, space.case.validate)
    requests = validation_requests(space, found)
    done = {label: afresh.finished(own) for label, own in requests.items()}
    space, done = with_held_out_curves(space, done)
    stale = changed(noted.fingerprint, validation_rests_on(space, found, done))
    return space, {} if stale else {**noted.by_candidate, COMPROMISE: noted}


def _values(one: Chosen, found: Calibration) -> tuple[CardValue, ...]:
    """The contact's parameters, and the effects that are on."""
    profiles = {p.name: p for p in found.identifiability.parameters}
    values = []
    for name in (*CONTACT, *one.effects):
        quantity, profile = PARAMETERS[name], profiles.get(name)
        known = profile is not None and not profile.refused
        values.append(
            CardValue(
                name=name,
                symbol=quantity.symbol,
                unit=quantity.unit,
                about=quantity.about,
                value=one.values[name],
                calibrated=profile is not None,
                searched=(profile.low, profile.high) if profile else None,
                interval_95=profile.interval_95 if profile and known else None,
                interval=_interval(profile) if profile else "given",
                pinned=profile.pinned if profile else None,
            )
        )
    return tuple(values)


def _interval(profile: ParameterProfile) -> str:
    """The 95 % interval in words."""
    whole = all(profile.walled) and not profile.refused
    return "the whole range searched" if whole else profile.range


def _compared(
    target: Target, role: str, verdict: Verdict | None, promise: Promise | None = None
) -> Compared:
    """A target beside what was promised and what fresh runs gave."""
    rows = {c.key: c for c in verdict.responses} if verdict else {}
    row = rows.get(target.key)
    return Compared(
        key=target.key,
        unit=QUANTITIES[target.response].unit,
        role=role,
        measured=target.value,
        scatter=target.scatter,
        replicates=target.replicates,
        tolerance=target.tolerance,
        predicted=promise.mean if promise else None,
        predicted_error=promise.error if promise else None,
        simulated=row.simulated if row else None,
        standard_error=row.standard_error if row else None,
        runs=row.runs if row else 0,
        verdict=row.verdict if row else "no fresh run",
    )


def _vessels(space: Workspace) -> tuple[Vessel, ...]:
    """The set-ups of what was measured, with their parameters."""
    problem = space.case.problem
    names = dict.fromkeys([*problem.experiments, *sorted(problem.held_out_experiments)])
    return tuple(
        Vessel(
            setup=name,
            used_for="calibration" if name in problem.experiments else "validation",
            parameters=problem.values_of(name),
        )
        for name in names
    )


def _provenance(space: Workspace, found: Calibration) -> Provenance:
    """Versions, files and runs."""
    case = space.case
    return Provenance(
        calibrator=__version__,
        yade=found.yade,
        case=case.path.name,
        case_sha256=_sha256(case.path),
        laboratory=case.measured.name,
        laboratory_sha256=_sha256(case.measured),
        runs=found.statuses,
        design=case.plan.design,
        synthetic=bool(case.truth),
        fingerprint=found.fingerprint,
    )


def _sha256(path: Path) -> str:
    """SHA-256 of a file, as sha256sum prints it."""
    return hashlib.sha256(read_bytes(path)).hexdigest()
