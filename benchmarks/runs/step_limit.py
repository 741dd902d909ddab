"""How large may the time step be for soft grains, on the contacts' time scale?

    python -m benchmarks.runs.step_limit          about 10 core-minutes, resumable

Writes benchmarks/results/step_limit.json and .png. The scale is sqrt(I/krot), the time of a grain
on the rolling spring of a resting contact (yade_scripts/material.py); the scripts bound their step
at 0.28 of it. Coarse sand, two Young's moduli, three seeds; a run that is not at rest 2.5 s after
its release counts as never resting (they take 1 to 1.5 s).
"""

from concurrent.futures import ThreadPoolExecutor

import matplotlib

from benchmarks.common import RESULTS, write
from benchmarks.runs.dem import HOURGLASSES, run_hourglass
from calibrator.case.physics import contact_time
from calibrator.runs.request import Request

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SHARES = (0.28, 0.35, 0.45)
MODULI, SEEDS = (0.6e6, 1.8e6), (71_001, 71_002, 71_003)
ROUGH = {"rolling_friction": 0.41, "sliding_friction": 0.65, "longest_time": 2.5}


def requests() -> list[tuple[float, float, dict]]:
    """(share, Young's modulus, parameters) of every run."""
    rows = []
    for share in SHARES:
        for modulus in MODULI:
            common = {**HOURGLASSES["coarse_sand"], **ROUGH, "young_modulus": modulus}
            numbers = Request.of("hourglass", **common).parameters
            step = share * contact_time(
                {n: float(v) for n, v in numbers.items() if not isinstance(v, str)}
            )
            rows += [
                (share, modulus, {**common, "time_step": step, "seed": seed}) for seed in SEEDS
            ]
    return rows


def main() -> None:
    """Run what is missing, count."""
    rows = requests()
    with ThreadPoolExecutor(2) as pool:
        records = list(pool.map(lambda row: run_hourglass("", row[2]), rows))
    found = []
    for share in SHARES:
        for modulus in MODULI:
            own = [
                r for (s, m, _), r in zip(rows, records, strict=True) if (s, m) == (share, modulus)
            ]
            found.append(
                {
                    "share": share,
                    "young_modulus": modulus,
                    "runs": len(own),
                    "never_at_rest": sum(r["status"] == "not_settled" for r in own),
                }
            )
    write("step_limit", {"runs": found})
    fig, axis = plt.subplots(figsize=(6, 3), layout="constrained")
    for modulus in MODULI:
        own = [f for f in found if f["young_modulus"] == modulus]
        axis.plot(
            [f["share"] for f in own],
            [f["never_at_rest"] for f in own],
            "o-",
            label=f"E = {modulus / 1e6:g} MPa",
        )
    axis.axvline(0.28, color="0.6", ls=":", label="the scripts' bound")
    axis.set(
        xlabel="time step over sqrt(I/krot)",
        ylabel=f"never at rest, of {len(SEEDS)}",
        yticks=range(len(SEEDS) + 1),
    )
    axis.legend(frameon=False)
    fig.savefig(RESULTS / "step_limit.png", dpi=110)
    print(*found, sep="\n")


if __name__ == "__main__":
    main()
