"""Calibrations by GrainLearning 2.0.5, in an environment of its own: see channel.py.

Everything is as shipped but the number of samples, by the documented rule 5 d ln d unless the job
gives one, and `sigma_tol` where the job gives one. Responses reach it in powers of ten of their
units that make the targets 1 to 10: with a density in kg/m3 beside a discharge rate in kg/s it dies
in its first iteration, of a covariance that it takes for singular.
"""

import math

import numpy as np
from channel import serve
from grainlearning import BayesianCalibration
from grainlearning.dynamic_systems import DynamicSystem


class Watched(BayesianCalibration):
    """Tells the benchmark the most probable sample after every iteration."""

    channel = None

    def run_one_iteration(self, index=-1):
        met = super().run_one_iteration(index)
        self.channel.recommend([self.get_most_prob_params()])
        return met


def calibrate(job, channel):
    """One calibration to GrainLearning's own end, or to the benchmark's."""
    dimensions = len(job["low"])
    samples = job["options"].get("num_samples") or round(5 * dimensions * math.log(dimensions))

    targets = np.array(job["targets"])
    units = 10.0 ** np.floor(np.log10(np.abs(targets)))

    def run_batch(calibration):
        values = np.array(channel.ask(calibration.system.param_data))
        calibration.system.set_sim_data((values / units)[:, :, None])

    tolerance = {"sigma_tol": job["options"]["sigma_tol"]} if "sigma_tol" in job["options"] else {}
    calibration = Watched.from_dict(
        {
            "num_iter": job["most_runs"] // samples,
            "callback": run_batch,
            "system": {
                "system_type": DynamicSystem,
                "param_names": job["names"],
                "param_min": job["low"],
                "param_max": job["high"],
                "obs_names": job["responses"],
                "obs_data": (targets / units)[:, None],
                "ctrl_data": [0.0],
                "num_samples": samples,
                **tolerance,
            },
            "inference": {"Bayes_filter": {}, "sampling": {"random_state": job["seed"]}},
            "save_fig": -1,
        }
    )
    calibration.channel = channel
    calibration.run()


if __name__ == "__main__":
    serve(calibrate)
