"""The contract with the caller: contract.json, one request in, one record out.

Standard library and numpy only; used inside YADE's interpreter. The file is the API: whoever writes
the yade-batch table and reads the records never imports anything from here.
"""

import hashlib
import json
import math
import os
import re

HERE = os.path.dirname(os.path.abspath(__file__))

with open(os.path.join(HERE, "contract.json")) as _stream:
    CONTRACT = json.load(_stream)


class BadInput(ValueError):
    """A parameter is impossible. The message ends with what to do."""


def parameters_of(setup):
    """{name: specification} of the parameters that a set-up takes."""
    return {
        n: s
        for n, s in CONTRACT["parameters"].items()
        if setup in s.get("setups", CONTRACT["setups"])
    }


def checked(setup, given):
    """Complete and check a request. Returns {name: value} with every parameter of the set-up.

    Raises BadInput for an unknown name, a wrong type, a number that is not finite or out of its
    range.
    """
    known = parameters_of(setup)
    for name in given:
        if name not in known:
            raise BadInput(
                "%s: unknown parameter %r; it takes %s" % (setup, name, ", ".join(sorted(known)))
            )
    return {
        name: _checked_value(name, spec, given.get(name, spec["default"]))
        for name, spec in known.items()
    }


def echoed(p):
    """The parameters as a record states them: what is off is not mentioned."""
    specs = CONTRACT["parameters"]
    silent = {n for n, spec in specs.items() if "effect" in spec or spec.get("optional")}
    return {n: _plain(v) for n, v in p.items() if n not in silent or v != specs[n]["default"]}


def _plain(value):
    """The value if JSON can hold it, else a text: a table's cell may become anything."""
    # as a float it would overflow, and beyond 4300 digits not even be shown
    if isinstance(value, int):
        return value if abs(value) < 10**300 else "an integer beyond 1e300"
    return (
        value
        if isinstance(value, str) or isinstance(value, float) and math.isfinite(value)
        else repr(value)
    )


def _checked_sizes(name, value):
    """The text of a size distribution: positive diameters that rise, and positive shares."""
    number = r"[0-9]{1,12}(?:\.[0-9]{1,12})?(?:e-?[0-9]{1,2})?"
    if (
        value == ""
        or isinstance(value, str)
        and re.fullmatch(r"%s:%s(\|%s:%s){0,49}" % ((number,) * 4), value, re.ASCII)
    ):
        sizes = [[float(n) for n in part.split(":")] for part in value.split("|") if part]
        diameters = [d for d, _ in sizes]
        if not sizes or (
            diameters == sorted(set(diameters))
            and diameters[-1] <= 10 * diameters[0]
            and min(share for _, share in sizes) > 0
            and 0 < diameters[0] < math.inf
        ):
            return value
    raise BadInput(
        "%s = %s: give up to 50 rising diameters within a factor of ten, each with its share of the"
        " number, such as 1.05:0.2|1.1:0.5|1.2:0.3" % (name, str(_plain(value))[:80])
    )


def _checked_value(name, spec, value):
    if spec["unit"] == "sizes":
        return _checked_sizes(name, value)
    if "choices" in spec:
        if value not in spec["choices"]:
            raise BadInput(
                "%s = %r: choose one of %s" % (name, _plain(value), ", ".join(spec["choices"]))
            )
        return value
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float))
        or isinstance(_plain(value), str)
    ):
        raise BadInput("%s = %s: give a finite number" % (name, _plain(value)))
    if not spec["low"] <= value <= spec["high"]:
        raise BadInput(
            "%s = %r: give a value from %g to %g" % (name, value, spec["low"], spec["high"])
        )
    if spec["unit"] == "integer":
        if value != int(value):
            raise BadInput("%s = %r: give a whole number" % (name, value))
        return int(value)
    return float(value)


def write_record(folder, run_id, record, curves):
    """Write <run_id>.npz (arrays), then <run_id>.json, each atomically: what exists is complete.

    The record gets a seal, a hash over all the rest: a number that a failing disk turns into
    another one is noticed. Raises ValueError if the record holds a NaN or an infinity.
    """
    os.makedirs(folder, exist_ok=True)
    if curves:
        import numpy as np

        _replace(
            os.path.join(folder, run_id + ".npz"),
            lambda stream: np.savez_compressed(stream, **curves),
        )
    seal = hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()[:16]
    text = json.dumps({**record, "seal": seal}, indent=1, sort_keys=True, allow_nan=False) + "\n"
    _replace(os.path.join(folder, run_id + ".json"), lambda stream: stream.write(text.encode()))


def _replace(path, write):
    temporary = "%s.%d.tmp" % (path, os.getpid())
    try:
        with open(temporary, "wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except OSError:  # on a full disk half a file would be in the way of the next attempt
        if os.path.exists(temporary):
            os.remove(temporary)
        raise
