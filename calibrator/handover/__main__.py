"""`python -m calibrator.handover` prints the JSON schema of a card: docs/card.schema.json."""

import json

from calibrator.handover.write_card import schema

if __name__ == "__main__":
    print(json.dumps(schema(), indent=1))
