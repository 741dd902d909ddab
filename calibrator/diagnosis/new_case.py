"""A named effect, written as a new case file."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np

from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.runs import Scene
from calibrator.diagnosis.verdict import Verdict
from calibrator.files import read_text, write_text
from calibrator.runs.workspace import Workspace


def write_new_case(space: Workspace, scene: Scene, verdict: Verdict) -> Path:
    """The case with the effect among its parameters, beside copies of the files that it names."""
    case = space.case
    (name,) = verdict.effects
    assert verdict.best is not None
    index = [e.name for e in scene.effects].index(name)
    effect = scene.effects[index]
    size, error = verdict.best.amplitude[index], verdict.best.amplitude_error[index]
    reach = max(3 * error, 0.5 * abs(size))
    ends = sorted(
        ex.column_value(effect, float(np.clip(size + s * reach, *effect.bounds))) for s in (-1, 1)
    )
    folder = space.folder("with_effect")
    text = re.sub(r"(?m)^(shipped|truth_file)\s*=.*\n", "", read_text(case.path))
    text = re.sub(r"(?m)^name\s*=.*$", f'name = "{case.name}_with_{name}"', text, count=1)
    files = {"measured": case.measured}
    if case.diagnosis.nuisances:
        files["nuisances"] = case.path.parent / case.diagnosis.nuisances
    for key, named in files.items():
        shutil.copyfile(named, folder / named.name)
        line = f"{key} = {json.dumps(named.name)}"
        text = re.sub(rf"(?m)^{key}\s*=.*$", line.replace("\\", r"\\"), text, count=1)
    path = folder / f"{case.name}_with_{name}.toml"
    head = f"\n# added by calibrator diagnose: {effect_of(name).called}\n[parameters.{name}]\n"
    write_text(path, f"{text}{head}low = {ends[0]!r}\nhigh = {ends[1]!r}\n")
    return path
