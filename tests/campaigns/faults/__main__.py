"""`python -m tests.campaigns.faults`: see kinds.py."""

from tests.campaigns.faults.kinds import main

main()
