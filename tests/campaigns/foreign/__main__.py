"""Is the verdict right where another engine made the laboratory?

    python -m tests.campaigns.foreign seal      draw the next series and publish its hashes
    python -m tests.campaigns.foreign run [N]   carry out the runs in LIGGGHTS, N at a time; resumes
    python -m tests.campaigns.foreign confirm   run in YADE what would be named, as diagnose does
    python -m tests.campaigns.foreign judge [N] judge the last series' laboratories, N at a time

The second writes grid/foreign_laboratories.csv, the third grid/foreign_confirmed.csv, the last
benchmarks/results/foreign.json.
"""

import sys

from calibrator.case.toml import read_case
from tests.campaigns.foreign import laboratories, truths


def main() -> None:
    """Seal, run, confirm or judge."""
    what, *some = sys.argv[1:] or ["judge"]
    case, jobs = read_case(truths.CASE), int(some[0]) if some else 1
    if what == "seal":
        print(f"series {truths.seal(case)} is sealed")
    elif what == "run":
        laboratories.carry_out(case, jobs)
    elif what in ("confirm", "judge"):
        from tests.campaigns.foreign import judge

        judge.confirm(case) if what == "confirm" else judge.main(jobs)
    else:
        sys.exit((__doc__ or "").strip())


if __name__ == "__main__":
    main()
