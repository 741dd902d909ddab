"""What a smaller vessel, or coarser grains, do to a response: the steps of `calibrator init`.

    python -m benchmarks.numerics.scaled_vessels    a second; no run is made

From pairs of shipped runs at the same frictions (grid/missing_effect.csv, no effect on): heaps from
cylinders of 10 and 7 grain diameters give the shift of their angles per d/D; hourglasses with necks
of 9 and 7 give k of Beverloo's law, a rate that goes with (D_0 - k d)^2.5. From the three sizes of
grid/pile_scale.csv (benchmarks/results/pile_scale.json) come the same shifts at 10 to 20 diameters.
Writes benchmarks/results/scaled_vessels.json, whose numbers are those of
calibrator/first_case/vessels.py and docs/init.md.
"""

import json
from collections import defaultdict

import numpy as np

from benchmarks.common import RESULTS, rounded, write
from benchmarks.numerics.sensitivities import RUNS
from calibrator.case.vocabulary import EFFECTS
from calibrator.runs.database import Database

FRICTIONS = ("rolling_friction", "sliding_friction")
HEAPS = ("pile_angle_of_repose_deg", "pile_equivalent_angle_deg")
DIAMETER, LARGE, SMALL = 2e-3, 20e-3, 14e-3  # grains, cylinders of heaps [m]
WIDE, NARROW = 18e-3, 14e-3  # necks [m]
SCALED = 0.8e-3  # grains of grid/pile_scale.csv


def pairs(setup: str, size: str, names: tuple[str, ...]) -> list[dict[float, np.ndarray]]:
    """Mean responses at each pair of frictions, by a size of the vessel."""
    found: dict[tuple[object, ...], dict[float, list[list[float]]]] = defaultdict(dict)
    for record in Database.read(RUNS).records.values():
        request = record.request
        plain = not EFFECTS.keys() & request.parameters.keys()
        usual = plain and request.value("restitution") == 0.9
        if record.status == "ok" and request.setup == setup and usual:
            own = found[tuple(request.value(n) for n in FRICTIONS)]
            values = [record.responses[n] for n in names]
            own.setdefault(float(request.value(size)), []).append(values)
    return [{s: np.mean(v, axis=0) for s, v in own.items()} for own in found.values()]


def shifts() -> dict[str, dict[str, float]]:
    """Degrees per d/D by which the smaller heap's angles are lower, with standard errors."""
    both = [
        p for p in pairs("conical_pile", "cylinder_diameter", HEAPS) if {LARGE, SMALL} <= p.keys()
    ]
    step = DIAMETER / SMALL - DIAMETER / LARGE
    lower = np.array([(p[LARGE] - p[SMALL]) / step for p in both])
    error = lower.std(axis=0, ddof=1) / len(lower) ** 0.5
    return {
        name: {"lower": rounded(m, 3), "error": rounded(e, 2), "pairs": len(lower)}
        for name, m, e in zip(HEAPS, lower.mean(axis=0), error, strict=True)
    }


def empty_ring() -> dict[str, float]:
    """k of Beverloo's law from the rates through both necks, with its standard error."""
    rates = pairs("hourglass", "neck_diameter", ("mass_flow_rate",))
    ratio = np.array(
        [float(p[WIDE][0] / p[NARROW][0]) for p in rates if {WIDE, NARROW} <= p.keys()]
    )
    root = ratio**0.4
    k = (root * NARROW - WIDE) / (root - 1) / DIAMETER
    error = k.std(ddof=1) / len(k) ** 0.5
    return {"k": rounded(k.mean(), 3), "error": rounded(error, 2), "pairs": len(k)}


def larger_heaps() -> dict[str, float]:
    """Slopes of a line over d/D through the three sizes: degrees, and a share of density."""
    sizes = json.loads((RESULTS / "pile_scale.json").read_text())["sizes"]
    ratio = np.array([1e3 * SCALED / float(name.split()[0]) for name in sizes])
    found = {}
    for name in (*HEAPS, "bulk_density"):
        mean = np.array([own[name]["mean"] for own in sizes.values()])
        slope, widest = np.polyfit(ratio, mean, 1)
        found[name] = rounded(-slope / (widest if name == "bulk_density" else 1.0), 2)
    return found


if __name__ == "__main__":
    write(
        "scaled_vessels",
        {
            "heaps_of_7_and_10": shifts(),
            "heaps_of_10_to_20": larger_heaps(),
            "necks_of_7_and_9": empty_ring(),
        },
    )
