"""What an outcome was computed from, as a short hash of each part of it.

An outcome that is read later, by another verb or by the page, is believed only where every part is
still the same: a corrected measurement, a changed vessel or a new run makes it stale.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

from calibrator.case.codec import plain

Fingerprint = dict[str, str]
"""Hash of each part by its name in words."""


def digest(value: object) -> str:
    """Short hash of a value that the codec can write."""
    text = json.dumps(plain(value), sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def fingerprint(parts: Mapping[str, object]) -> Fingerprint:
    """The hashes of these parts."""
    return {name: digest(part) for name, part in parts.items()}


def changed(was: Fingerprint, now: Fingerprint) -> list[str]:
    """Names of the parts that differ, in order."""
    return [name for name in {**now, **was} if was.get(name) != now.get(name)]
