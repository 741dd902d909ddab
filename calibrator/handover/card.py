"""A material card: what somebody who takes the material should know, as one value."""

from __future__ import annotations

from dataclasses import dataclass

from calibrator.case.fingerprint import Fingerprint
from calibrator.case.values import Value

VERSION = 1
"""Of the card's format; raised when a field changes its meaning."""


@dataclass(frozen=True)
class CardValue:
    """A parameter of the material.

    Attributes
    ----------
    name, symbol, unit, about : as in the vocabulary; value : in that unit.
    calibrated : whether the targets chose it; the others were fixed by the case, or are defaults.
    searched : bounds of the search; interval_95 : what the targets allow, the other parameters
        always adapted; both None where it was not calibrated, the second also where no set agrees
        with the targets.
    interval : the interval in words, one-sided where a bound of the search ends it.
    pinned : whether the targets hold it from both sides; None where it was not calibrated.
    """

    name: str
    symbol: str
    unit: str
    about: str
    value: Value
    calibrated: bool
    searched: tuple[float, float] | None
    interval_95: tuple[float, float] | None
    interval: str
    pinned: bool | None


@dataclass(frozen=True)
class Member:
    """One of the equivalent sets: calibrated parameters by name, in their units.

    label : a candidate's of the front, or "accepted" and a number; verified : whether fresh runs
    met every target, None where none were made.
    """

    label: str
    parameters: dict[str, float]
    verified: bool | None


@dataclass(frozen=True)
class Compared:
    """A measured response, and what fresh runs of the material gave.

    Attributes
    ----------
    key : setup.response; unit : its unit; role : "calibrate" or "held_out".
    measured, scatter, replicates : mean, standard deviation of one repeat (0 where none is given),
        and number of repeats; tolerance : the relative error that counts as met.
    predicted, predicted_error : what the interpolant promises, with its standard error; None for
        what was not calibrated on.
    simulated, standard_error, runs : of fresh runs; None and 0 where there are none.
    verdict : what became of it, in words.
    """

    key: str
    unit: str
    role: str
    measured: float
    scatter: float
    replicates: int
    tolerance: float
    predicted: float | None
    predicted_error: float | None
    simulated: float | None
    standard_error: float | None
    runs: int
    verdict: str


@dataclass(frozen=True)
class Vessel:
    """A set-up of the measurements: its parameters in SI units, and what it was used for."""

    setup: str
    used_for: str
    parameters: dict[str, Value]


@dataclass(frozen=True)
class Provenance:
    """Where the card comes from.

    Attributes
    ----------
    calibrator, yade : versions; case, laboratory : names and SHA-256 of the two files.
    runs : how the runs behind the calibration ended; design : of their plan.
    synthetic : whether the laboratory is made up, with a truth that is known.
    fingerprint : hash of each part of what the calibration was computed from.
    """

    calibrator: str
    yade: tuple[str, ...]
    case: str
    case_sha256: str
    laboratory: str
    laboratory_sha256: str
    runs: dict[str, int]
    design: str
    synthetic: bool
    fingerprint: Fingerprint


@dataclass(frozen=True)
class Citation:
    """What to cite: lines of plain text, and the same as BibTeX."""

    text: tuple[str, ...]
    bibtex: str


@dataclass(frozen=True)
class Card:
    """A calibrated material and what is known of it.

    Attributes
    ----------
    version : of the format; name, about, candidate : case, its purpose, and the parameter set.
    verified, standing : whether fresh runs met every target that it was calibrated on (None: none
        say so), and the same in words; validated : likewise for what was held out.
    values : the contact's parameters and the effects that are on.
    family : other sets that the targets cannot tell from it, with `family_note`.
    compared : every response that was measured; vessels : the set-ups.
    valid_for, not_calibrated_for : sentences.
    reproduce : commands, in order.
    """

    version: int
    name: str
    about: str
    candidate: str
    verified: bool | None
    validated: bool | None
    standing: str
    values: tuple[CardValue, ...]
    family: tuple[Member, ...]
    family_note: str
    compared: tuple[Compared, ...]
    vessels: tuple[Vessel, ...]
    valid_for: tuple[str, ...]
    not_calibrated_for: tuple[str, ...]
    provenance: Provenance
    reproduce: tuple[str, ...]
    citation: Citation


CITATION = Citation(
    text=(
        "The DEM calibrator developers: DEM calibrator: automatic calibration of discrete element"
        " parameters with YADE (GPL-3.0-or-later)",
        "H. Q. Do, A. M. Aragón, D. L. Schott: A calibration framework for discrete element model"
        " parameters using genetic algorithms, Advanced Powder Technology (2018),"
        " doi 10.1016/j.apt.2018.03.001",
        "The YADE developers: YADE: open-source discrete element framework, https://yade-dem.org",
    ),
    bibtex="""@software{dem_calibrator,
  title = {DEM calibrator: automatic calibration of discrete element parameters with YADE},
  author = {{The DEM calibrator developers}},
  license = {GPL-3.0-or-later}
}
@article{do_aragon_schott_2018,
  title = {A calibration framework for discrete element model parameters using genetic algorithms},
  author = {Do, Huy Q. and Aragón, Alejandro M. and Schott, Dingena L.},
  journal = {Advanced Powder Technology},
  year = {2018},
  doi = {10.1016/j.apt.2018.03.001}
}
@software{yade,
  title = {YADE: open-source discrete element framework},
  author = {{The YADE developers}},
  url = {https://yade-dem.org}
}
""",
)
"""Of CITATION.cff, which does not come with an installed package."""
