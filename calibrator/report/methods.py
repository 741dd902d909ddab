"""How the calibration was done, with its own numbers, to be pasted into a paper; and what to cite.

The text is Markdown with citations as Pandoc reads them ([@key]); the keys are BibTeX'.
"""

from __future__ import annotations

import importlib.metadata
import platform
import re
from collections.abc import Sequence
from pathlib import Path

from calibrator import __version__
from calibrator.case.problem import Target
from calibrator.case.vocabulary import PARAMETERS
from calibrator.files import write_text
from calibrator.report.findings import Findings
from calibrator.report.html import Album, folded, note, section
from calibrator.report.model import contact_law, dates, every_run, requests
from calibrator.report.seen import beside
from calibrator.report.words import (
    distinct,
    experiment_words,
    key_words,
    listed,
    number,
    response,
    text,
    with_error,
    words,
)
from calibrator.responses.objectives import OBJECTIVES
from calibrator.runs.setups import numbers, particles
from calibrator.search.outcome import COMPROMISE
from calibrator.verification.outcome import Comparison

METHODS, REFERENCES = "methods.md", "references.bib"
ENTRIES = (
    (Path(__file__).parent / "references.bib")
    .read_text(encoding="utf-8")
    .replace("VERSION", __version__)
)
"""BibTeX of all that a calibration may rest on."""
INTERPOLANTS = {
    "process": (
        "Gaussian processes (Matern 5/2 kernel and a linear trend, the seed noise from replicates)"
        " [@rasmussen_williams_2006; @scikit_learn]"
    ),
    "multilinear": "multilinear interpolation on the grid",
}


def methods(findings: Findings, album: Album) -> str:
    """The section with the text and its references, which are also written beside the page."""
    said = methods_text(findings)
    cited = bibliography(said)
    folder = findings.space.path
    write_text(folder / METHODS, said)
    write_text(folder / REFERENCES, cited)
    return section(
        "Methods and references",
        note(
            f"Ready to be pasted into a paper; also in {METHODS} and {REFERENCES} beside this"
            " page. [@...] are citations as Pandoc reads them."
        ),
        f'<pre class="prose">{text(said)}</pre>',
        folded("References as BibTeX", f"<pre>{text(cited)}</pre>"),
    )


def bibliography(said: str) -> str:
    """BibTeX of what a text cites, in the order of references.bib.

    Raises KeyError for a citation without an entry.
    """
    entries = {
        re.split(r"[{,]", entry, maxsplit=2)[1]: entry
        for entry in re.split(r"^(?=@)", ENTRIES, flags=re.MULTILINE)
        if entry
    }
    cited = set(re.findall(r"(?<=[\[ ])@(\w+)", said))
    if missing := cited - set(entries):
        raise KeyError(f"no reference {sorted(missing)}")
    return "".join(entry for key, entry in entries.items() if key in cited)


def methods_text(findings: Findings) -> str:
    """The paragraphs."""
    parts = (_what, _simulations, _runs, _search, _answer, _tests, _versions)
    return "\n\n".join(part(findings) for part in parts) + "\n"


def _what(findings: Findings) -> str:
    problem = findings.space.case.problem
    yade = distinct(every_run(findings), "yade")
    return (
        f"{_first_up(listed([words(n) for n in problem.names]))} were calibrated against the"
        f" measured {listed([key_words(t.key) for t in problem.targets])} with DEM calibrator"
        f" {__version__} [@dem_calibrator] and YADE {yade} [@yade_documentation], after the method"
        " of Do et al. [@do_aragon_schott_2018]."
    )


def _first_up(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def _simulations(findings: Findings) -> str:
    found = requests(findings)
    first = next(iter(found.values()))
    p = numbers(first)
    fixed = [
        f"{words(n)} {number(p[n])}{_unit(PARAMETERS[n].unit)}"
        for n in ("particle_density", "young_modulus", "poisson_ratio", "restitution")
        if n not in findings.space.case.problem.names
    ]
    grains = [f"{experiment_words(name)} ({particles(r)} grains)" for name, r in found.items()]
    law = contact_law(first)
    for word, key in (
        ("Hertz' normal force", "hertz_1882"),
        ("Mindlin's shear stiffness", "mindlin_deresiewicz_1953"),
        ("elastic-plastic rolling spring", "ai_2011"),
    ):
        law = law.replace(word, f"{word} [@{key}]")
    return (
        f"Spheres of radius {number(p['particle_radius'])} m with {listed(fixed)} were simulated"
        f" in these set-ups: {listed(grains)}. {law}"
    )


def _unit(unit: str) -> str:
    return {"1": "", "deg": " degrees"}.get(unit, f" {unit}")


def _runs(findings: Findings) -> str:
    case = findings.space.case
    good = sum(r.status == "ok" for r in findings.records)
    count = case.fidelity.dear_sets if case.fidelity else case.plan.sets
    sets = {
        "sobol": f"{count} sets of a Sobol sequence with {case.plan.replicates} replicates each",
        "grid": f"a full grid with {case.plan.replicates} replicates",
        "adaptive": f"an adaptive design that started from {count} sets of a Sobol sequence",
    }[case.plan.design]
    bounds = [
        f"{words(p.name)} from {number(p.low)} to {number(p.high)}{_unit(PARAMETERS[p.name].unit)}"
        + (" (logarithmic scale)" if p.scale == "log" else "")
        for p in case.problem.parameters
    ]
    return (
        f"The plan was {sets}, within {listed(bounds)}: {len(findings.records)} runs, of which"
        f" {good} gave all responses. The responses were interpolated over the parameters by"
        f" {INTERPOLANTS[case.interpolation.method]}.{_cheap_runs(findings)}"
    )


def _cheap_runs(findings: Findings) -> str:
    """What cheap runs were made and used for; empty where there were none."""
    fidelity = findings.space.case.fidelity
    if fidelity is None:
        return ""
    changed = [
        f"{words(n)} {v if isinstance(v, str) else number(v) + _unit(PARAMETERS[n].unit)}"
        for n, v in fidelity.values.items()
    ]
    return (
        f" They lean on {len(findings.cheap)} cheaper runs with {listed(changed)}, by linear"
        " co-kriging [@kennedy_ohagan_2000]."
    )


def _search(findings: Findings) -> str:
    case, found = findings.space.case, findings.calibration
    s = case.search
    goals = [f"{OBJECTIVES[n].symbol}, {OBJECTIVES[n].about}" for n in s.objectives]
    bits = sorted({p.bits for p in case.problem.parameters})
    return (
        f"NSGA-II [@deb_2002; @pymoo] minimised {listed(goals)}, on the interpolated responses:"
        f" population {s.population}, {s.generations} generations, binary code of"
        f" {listed([str(b) for b in bits])} bits per parameter, crossover probability"
        f" {number(s.crossover)}, mutation probability per bit {number(s.mutation)}, seed"
        f" {s.seed}, in {s.repeats} repeats with successive seeds. Its front has"
        f" {found.front_size} sets. The recommended set was chosen by this rule:"
        f" {findings.in_words(found.compromise_reason)}."
    )


def _answer(findings: Findings) -> str:
    chosen = findings.calibration.compromise.parameters
    said = [
        f"{words(p.name)} {number(chosen[p.name])}{_unit(PARAMETERS[p.name].unit)} (95 % interval:"
        f" {p.interval(lambda end: number(end, 3))}"
        f"{'' if p.pinned else ', not pinned down'})"
        for p in findings.calibration.identifiability.parameters
    ]
    return (
        f"Recommended are {listed(said)}; the intervals are profile likelihoods of the"
        " measurements [@raue_2009]."
    )


def _tests(findings: Findings) -> str:
    problem, verified = findings.space.case.problem, findings.verification
    if verified is None:
        return "The recommended set has not been verified by fresh runs."
    own = verified.candidates[COMPROMISE]
    said = (
        f"{own.total} fresh runs with seeds that the calibration had not seen gave"
        f" {_compared(problem.targets, own.responses)}. The verification"
        f" {'passed' if verified.passed else 'failed'}."
    )
    if findings.validation is None or not problem.held_out:
        return f"{said} No measurement that was held out has been predicted."
    held = findings.validation
    return (
        f"{said} Of what was held out, {held.total} fresh runs predicted"
        f" {_compared(problem.held_out, held.responses)}. The validation"
        f" {'passed' if held.passed else 'did not pass'}."
    )


def _compared(targets: Sequence[Target], rows: Sequence[Comparison]) -> str:
    """Every target: simulated, measured, and what became of it."""
    said = []
    for target, row in zip(targets, rows, strict=True):
        if row.simulated is None or row.relative_error is None:
            said.append(f"no {key_words(target.key)}")
            continue
        verdict = "met" if row.passed else "cannot tell" if row.undecided else "missed"
        unit = _unit(response(target.key).unit)
        said.append(
            f"{key_words(target.key)} {with_error(row.simulated, row.standard_error or 0.0)}{unit},"
            f" {beside(row.relative_error)} the measured"
            f" {with_error(target.value, target.standard_error)}{unit} ({verdict})"
        )
    return "; ".join(said)


def _versions(findings: Findings) -> str:
    of = importlib.metadata.version
    return (
        f"Python {platform.python_version()}, NumPy {of('numpy')} [@numpy], SciPy {of('scipy')}"
        f" [@scipy], scikit-learn {of('scikit-learn')} [@scikit_learn] and pymoo {of('pymoo')}"
        f" [@pymoo] were used; the scripts that made the runs have the hash"
        f" {distinct(every_run(findings), 'scripts')}. {dates(every_run(findings))}"
    )
