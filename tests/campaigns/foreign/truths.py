"""The sealed truths: what is hidden in which laboratory, drawn from a secret number.

Kinds, sizes and the way they are drawn are public here, and so is the SHA-256 of every truth
(commitments.txt, in the format of sha256sum). The truths themselves, each with a salt of its own,
lie in truths.sealed, packed so that nobody reads them by accident: the runner and, afterwards, the
judge unpack them, and nothing that a verdict rests on does.

A series is one such draw, in a folder of its own. Once it has been judged, its truths are known,
and rules may be made with them; then the next series is drawn, which no rule has seen.
"""

import base64
import hashlib
import json
import secrets
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Effect
from calibrator.files import read_text, write_text
from calibrator.runs.request import Request
from tests.campaigns.hidden.laboratory import JITTER

REPO = Path(__file__).resolve().parents[3]
CASE = REPO / "cases" / "missing_effect.toml"
SERIES = Path(__file__).with_name("series")
COMMITMENTS, SEALED = "commitments.txt", "truths.sealed"  # in the folder of a series
NOTHING, EACH = 12, 4  # laboratories with nothing hidden, and of each kind
IN_LIBRARY = ("bond_number", "size_spread", "neck_error", "tilt_deg", "wall_friction_ratio")
OUTSIDE = ("inelastic_and_viscous", "vibration", "soft_grains")
# ends of the four ranges, weak to strong, that sizes are drawn from, in the case's plausible sizes;
# what is hidden in YADE's laboratories is 0.4, 0.8 or 1.5
SIZES = (0.4, 0.7, 1.0, 1.25, 1.5)
RESTITUTION, ROLLING_VISCOSITY = (0.3, 0.6), (0.2, 0.5)
SHAKING, SHAKING_TIME = (0.7, 1.3), 0.6  # peak acceleration over gravity; [s] since the release
SOFT = (2.5e4, 6e4)  # Young's modulus [Pa]: 17 to 40 times below the case's
REPLICATES, MOST = 8, 14  # runs of an experiment; with spare ones where too few end well
DRAWN = 5  # of them, by a trial
IN_A_SERIES = NOTHING + EACH * (len(IN_LIBRARY) + len(OUTSIDE))
FIRST_SEED, SEEDS_EACH = 1_950_000_000, 10_000


@dataclass(frozen=True)
class Laboratory:
    """What one laboratory is.

    Attributes
    ----------
    number : from 1 on through all series, in the order of the runs, which is drawn as well.
    kind : "nothing", a column of the library, or one of OUTSIDE.
    parameters : rolling and sliding friction.
    hidden : columns with the values that they have in the laboratory.
    rolling_viscosity : damping ratio of the rolling spring, 0 where there is no dashpot.
    size : of a library effect, in the case's plausible sizes, with its sign; else 0.
    """

    number: int
    kind: str
    parameters: dict[str, float]
    hidden: dict[str, float]
    rolling_viscosity: float
    size: float

    def requests(self, case: Case, found: list[ex.Experiment]) -> list[list[Request]]:
        """All runs that may be made, a list per experiment; grains always differ a little."""
        at = np.array([self.parameters[n] for n in case.problem.names])
        columns = {"size_spread": JITTER, **self.hidden}
        first = FIRST_SEED + SEEDS_EACH * self.number
        return [
            [ex.request(case, e, at, first + 1000 * i + j, columns) for j in range(MOST)]
            for i, e in enumerate(found)
        ]


def drawn(case: Case, secret: int, series: int = 1) -> list[Laboratory]:
    """All laboratories of a series.

    Those with nothing hidden and one of each kind come first, each group shuffled. The frictions
    are uniform over the whole box; those of the laboratories with nothing hidden are a Latin square
    in it, so that its corners are not left out.
    """
    rng, d = np.random.default_rng(secret), len(case.problem.names)
    cells = np.array([rng.permutation(NOTHING) for _ in range(d)]).T
    squares = (cells + rng.random((NOTHING, d))) / NOTHING
    first = [("nothing", 0, unit) for unit in squares]
    later = []
    for kind in (*IN_LIBRARY, *OUTSIDE):
        levels = rng.permutation(EACH)
        first.append((kind, int(levels[0]), rng.random(d)))
        later += [(kind, int(level), rng.random(d)) for level in levels[1:]]
    effects = {e.name: e for e in ex.library(case)}
    order = [first[i] for i in rng.permutation(len(first))]
    order += [later[i] for i in rng.permutation(len(later))]
    made = []
    for number, (kind, level, unit) in enumerate(order, 1 + IN_A_SERIES * (series - 1)):
        values = map(float, ex.point(case, unit))
        at = {n: round(v, 6) for n, v in zip(case.problem.names, values, strict=True)}
        made.append(Laboratory(number, kind, at, *_hidden(kind, level, effects, rng)))
    return made


def _hidden(
    kind: str, level: int, effects: dict[str, Effect], rng: np.random.Generator
) -> tuple[dict[str, float], float, float]:
    """Columns, rolling viscosity and size of what is hidden; level : which quarter, from 0."""
    share = (level + float(rng.random())) / EACH

    def between(low: float, high: float) -> float:
        return low + share * (high - low)

    if kind in effects:
        size = float(rng.uniform(*SIZES[level : level + 2]))
        sign = 1 if effects[kind].sign == "+" else int(rng.choice([-1, 1]))
        return {kind: ex.column_value(effects[kind], sign * size)}, 0.0, sign * size
    if kind == "inelastic_and_viscous":
        # the strongest has the lowest restitution
        return {"restitution": between(*RESTITUTION[::-1])}, between(*ROLLING_VISCOSITY), 0.0
    if kind == "vibration":
        return {"shaking": between(*SHAKING), "shaking_time": SHAKING_TIME}, 0.0, 0.0
    if kind == "soft_grains":
        return {"young_modulus": SOFT[1] * (SOFT[0] / SOFT[1]) ** share}, 0.0, 0.0
    return {}, 0.0, 0.0


def seal(case: Case) -> int:
    """Draw the next series from a number that nobody has seen, and publish its hashes."""
    series = 1 + len(sealed())
    made = drawn(case, secrets.randbits(64), series)
    lines = [
        json.dumps({"truth": vars(one), "salt": secrets.token_hex(16)}, sort_keys=True)
        for one in made
    ]
    folder = SERIES / str(series)
    folder.mkdir(parents=True)
    pack(lines, folder)
    said = [f"{digest(x)}  laboratory {one.number}\n" for x, one in zip(lines, made, strict=True)]
    write_text(folder / COMMITMENTS, "".join(said))
    return series


def sealed() -> list[Path]:
    """Folders of all series, in their order."""
    return sorted((p.parent for p in SERIES.glob(f"*/{SEALED}")), key=lambda p: int(p.name))


def pack(lines: list[str], folder: Path) -> None:
    """Write the lines of all truths of a series into its sealed file."""
    packed = base64.b85encode(zlib.compress("\n".join(lines).encode(), 9)).decode()
    rows = [packed[i : i + 100] for i in range(0, len(packed), 100)]
    write_text(folder / SEALED, "\n".join(rows) + "\n")


def unpacked(folder: Path) -> list[str]:
    """The lines of all truths of a series."""
    packed = base64.b85decode("".join(read_text(folder / SEALED).split()))
    return zlib.decompress(packed).decode().split("\n")


def digest(line: str) -> str:
    """SHA-256 of one sealed truth."""
    return hashlib.sha256(line.encode()).hexdigest()


def series_of(number: int) -> int:
    """The series of a laboratory."""
    return 1 + (number - 1) // IN_A_SERIES


def opened() -> dict[int, tuple[Laboratory, str]]:
    """The sealed laboratories of all series by number, and the line of each whose hash is public.

    Raises SystemExit where one is not the truth whose hash was published.
    """
    if not sealed():
        raise SystemExit("no series is sealed: python -m tests.campaigns.foreign seal")
    found: dict[int, tuple[Laboratory, str]] = {}
    for folder in sealed():
        published = [line.split()[0] for line in read_text(folder / COMMITMENTS).splitlines()]
        lines = unpacked(folder)
        if [digest(line) for line in lines] != published:
            raise SystemExit("the seal is broken: a truth is not the one whose hash was published")
        truths: list[dict[str, Any]] = [json.loads(line)["truth"] for line in lines]
        found |= {
            one["number"]: (Laboratory(**one), line)
            for one, line in zip(truths, lines, strict=True)
        }
    return found
