"""`python -m tests.campaigns.faults`: see campaign.py."""

from tests.campaigns.faults.campaign import main

main()
