"""What stands in summary.json: the outcome of each verb, and the JSON schema of them all.

`python -m calibrator.summary` prints the schema, which is published as docs/summary.schema.json.
"""

from __future__ import annotations

import json

from calibrator.case.codec import Table, schema_of
from calibrator.case.vocabulary import SCHEMA
from calibrator.check import Checked
from calibrator.diagnosis.outcome import Diagnosis, Preflight
from calibrator.handover.export import Export
from calibrator.handover.write_card import CardWritten
from calibrator.plan.outcome import Collection, Forecast
from calibrator.report.page import Page
from calibrator.search.outcome import Calibration
from calibrator.verification.outcome import Validation, Verification
from calibrator.view.outcome import View

OUTCOMES: dict[str, type] = {
    "check": Checked,
    "plan": Forecast,
    "run": Collection,
    "collect": Collection,
    "calibrate": Calibration,
    "verify": Verification,
    "validate": Validation,
    "report": Page,
    "preflight": Preflight,
    "diagnose": Diagnosis,
    "view": View,
    "export": Export,
    "card": CardWritten,
}
"""Outcome of each verb."""


def schema() -> Table:
    """JSON schema (draft 2020-12) of summary.json."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "summary.json of a results folder: what each verb found",
        "type": "object",
        "properties": {
            "case": {"type": "string", "description": "name of the case"},
            "schema": {"const": SCHEMA, "description": "version of the record format"},
            "seal": {"type": "string", "description": "hash over all the rest"},
            **{verb: schema_of(cls) for verb, cls in OUTCOMES.items()},
        },
        "required": ["case", "schema", "seal"],
        "additionalProperties": False,
    }


if __name__ == "__main__":
    print(json.dumps(schema(), indent=1))
