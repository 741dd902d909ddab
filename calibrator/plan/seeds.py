"""All seeds in one place: which range each kind of run takes its seeds from."""

from __future__ import annotations

SEED_STRIDE = 100
"""Seeds of neighbouring sets lie this far apart, so that a plan can gain replicates without
changing the others.
"""


PROPOSED_SEED = 10_000_000
"""Added to the plan's first seed for the runs that an adaptive design chooses."""


SUBSTITUTE_SEED = 50_000_000
"""Added to the seed of a clogged run to make its substitute's."""


# between the first seeds of experiments: a filling must not be the same in two of them
EXPERIMENT_STRIDE = 1_000_000
CHANGE_SEED = 200_000_000  # added to the seeds of the fingerprints' runs
SET_STRIDE = 100  # between the seeds of neighbouring sets, for their replicates
CONFIRM_SEED = 400_000_000  # added to the seeds of the runs that confirm an explanation
