"""`python -m tests.campaigns.answers`: see campaign.py."""

from tests.campaigns.answers.campaign import main

main()
