"""The folder in which everything happens: a good case, its results, and traps."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from calibrator.case.toml import read_case
from calibrator.files import parse_json
from calibrator.plan.forecast import forecast
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import collect
from calibrator.runs import workspace
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.search.calibrate import calibrate

CASE = """name = "toy"
about = "made up"
measured = "lab.csv"
truth_file = "truth.toml"
[parameters.rolling_friction]
low = 0.05
high = 0.45
samples = 2
[parameters.sliding_friction]
low = 0.2
high = 0.7
samples = 2
bits = 6
[parameters.young_modulus]
low = 0.5e6
high = 4e6
samples = 2
scale = "log"
[fixed]
restitution = 0.9
rolling_spring = "epsd2"
[setups.hourglass]
fill_mass = 16e-3
[targets."hourglass.bulk_density"]
tolerance = 0.01
weight = 2
[plan]
design = "sobol"
sets = 6
replicates = 2
seed = 1000
[interpolation]
method = "process"
similarity = false
[search]
objectives = ["error", "time_cost"]
population = 20
generations = 4
crossover = 0.9
repeats = 1
[verify]
replicates = 2
shipped = "runs.csv"
[fidelity]
dear_sets = 4
[fidelity.values]
particle_radius = 1.5e-3
[conditions.wide]
setup = "hourglass"
neck_diameter = 16e-3
[diagnosis]
effects = ["bond_number", "neck_error"]
sets = 6
effect_sets = 5
nuisances = "nuisances.csv"
[run]
jobs = 1
budget_core_hours = 2.5
shipped = "../grid/runs.csv"
"""
LAB = """# a note
setup,response,value,scatter,replicates,unit,role
hourglass,bulk_density,1605.6,5,8,kg/m3,calibrate
hourglass,drained_equivalent_angle_deg,46.8,0.2,8,deg,calibrate
ledge,ledge_equivalent_angle_deg,37.44,,,deg,held_out
"""
WITH_CONDITIONS = """setup,condition,response,value,scatter,replicates,unit,role
hourglass,,bulk_density,1605.6,5,8,kg/m3,calibrate
hourglass,,mass_flow_rate,0.0246,1e-3,8,kg/s,diagnose
hourglass,wide,mass_flow_rate,0.0301,,3,kg/s,held_out
ledge,,ledge_equivalent_angle_deg,37.44,0.5,5,deg,diagnose
"""
NUISANCES = """# errors that observables share
nuisance,observables,error,unit
reading of angles,*_angle*_deg,0.5,deg
filled volume,*.bulk_density,0.5,%
neck,effect:neck_error,0.05e-3,m
"""
TRUTH = "[parameters]\nrolling_friction = 0.25\n"


class Yard:
    """A good case and its results, traps beside it, and a place where code would leave its mark."""

    def __init__(self, path: Path) -> None:
        self.path, self.cases, self.grid = (
            path,
            path / "project" / "cases",
            path / "project" / "grid",
        )
        self.marks = path / "marks"
        for folder in (self.cases, self.grid, self.marks):
            folder.mkdir(parents=True)
        (self.cases / "lab.csv").write_text(LAB)
        (self.cases / "nuisances.csv").write_text(NUISANCES)
        (self.cases / "truth.toml").write_text(TRUTH)
        (self.cases / "toy.toml").write_text(CASE)
        self.case = read_case(self.cases / "toy.toml")
        self.requests = plan_requests(self.case)
        self.database = made_up_database(self.requests)
        self.database.write(self.grid / "runs.csv")
        shutil.copy(self.grid / "runs.csv", self.cases)
        self._set_traps()
        self.space = workspace.Workspace(self.case, path / "results" / "toy")
        for verb in (forecast, collect, calibrate):
            verb(self.space)
        self.summary = parse_json((self.space.path / "summary.json").read_text())
        (self.space.path / "records").mkdir()

    def _set_traps(self) -> None:
        secret = self.path / "secret.csv"
        secret.write_text(LAB)
        os.mkfifo(self.cases / "pipe")
        (self.cases / "loop").symlink_to("loop")
        (self.cases / "away").symlink_to(secret)
        (self.cases / "zero").symlink_to("/dev/zero")
        (self.cases / "folder").mkdir()

    def executed(self) -> int:
        """How many times code from an input has run."""
        return len(list(self.marks.iterdir()))

    def spells(self) -> list[str]:
        """Texts that leave a mark if Python evaluates them or a shell runs them."""
        mark = f"{self.marks}/$$"
        python = f"__import__('os').system('touch {self.marks}/python')"
        return [
            python,
            f"1 if {python} else 1",
            f"$(touch {mark})",
            f"`touch {mark}`",
            f"; touch {mark};",
            f"'; touch {mark} #",
        ]


def made_up_database(requests: list[Request]) -> Database:
    """Runs that never took place, smooth in the parameters."""
    records = []
    for i, r in enumerate(requests):
        p = r.parameters
        density = 1700 - 120 * float(p["sliding_friction"]) + i % 3
        angle = 40 + 20 * float(p["rolling_friction"]) + 0.1 * (i % 2)
        responses = {"bulk_density": density, "drained_equivalent_angle_deg": angle}
        records.append(
            Record(
                r,
                "ok",
                responses,
                "",
                {"particles": 9, "steps": 10},
                {"yade": "none", "scripts": "none"},
            )
        )
    return Database(records)
