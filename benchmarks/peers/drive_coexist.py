"""Calibrations by ACCES (coexist 0.3.2), in an environment of its own: see channel.py.

Everything is as shipped but `evaluate_solutions`, which would start a Python interpreter for each
run. The errors are the relative ones of each response.
"""

import contextlib
import tempfile
from pathlib import Path

import numpy as np
from channel import serve
from coexist import Access
from coexist.combiners import Product, combiner

SCRIPT = """# ACCESS PARAMETERS START
import coexist
parameters = coexist.create_parameters(variables={names}, minimums={low}, maximums={high})
# ACCESS PARAMETERS END
error = 0
"""


@combiner
def squares(errors):
    return float(np.sum(errors**2))


class InProcess(Access):
    """Gets its runs from the benchmark, and tells it what every epoch has found."""

    def evaluate_solutions(self, solutions, epoch):
        values = np.array(self.channel.ask(solutions))
        errors = np.abs(values / self.targets - 1)
        return np.column_stack([errors, [self.multi_objective.combine(e) for e in errors]])

    def finished(self, es):
        self.channel.recommend(
            [es.result.xbest * self.setup.scaling, es.result.xfavorite * self.setup.scaling]
        )
        return super().finished(es)


def calibrate(job, channel):
    """One calibration to ACCES's own end, or to the benchmark's.

    It has a folder of its own, as ACCES would resume an earlier one.
    """
    combine = Product() if job["options"]["combiner"] == "product" else squares
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("sim.py").write_text(
            SCRIPT.format(**{key: job[key] for key in ("names", "low", "high")})
        )
        access = InProcess("sim.py")
        access.channel, access.targets = channel, np.array(job["targets"])
        access.learn(
            num_solutions=8,
            target_sigma=0.1,
            random_seed=job["seed"],
            multi_objective=combine,
            verbose=1,
        )


if __name__ == "__main__":
    serve(calibrate)
