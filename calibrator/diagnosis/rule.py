"""The thresholds of a verdict, in one table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Rule:
    """Thresholds of the verdict; tests/campaigns/hidden/campaign.py measures what they lead to.

    Attributes
    ----------
    p_effect, p_chi2 : probabilities below which there is a gap: of the best likelihood ratio of any
        effect, and of the residual's length. Together they are to raise the alarm in one complete
        model of forty, if all errors are as stated; the sharper test has the larger share.
    adequacy : probability that a fit needs to count as one, of the surfaces or of fresh runs.
    fit : probability that the fit of a name needs: four of five right ones have more, where all
        errors are as stated; of what is outside the library an effect often explains the most part
        and not all.
    posterior : that a name needs among all explanations, "unknown" among them.
    lead : in deviance (minus twice the log likelihood) before any rival, another effect or a fixed
        value that is uncertain: 6 is twenty to one.
    errors : standard errors by which a named amplitude differs from nothing.
    reach : plausible sizes that it may have: runs were made up to 1.5, and where that much is there
        the size that is found may be larger by its error.
    ghost, ghost_of_few, few : probability with which the library, turned at random, explains as
        much; below `few` degrees of freedom chance explains more, so less of it is allowed.
    coverage : posterior probability that a set which cannot be told apart holds.
    held_out : probability that data held out need under what would be named.
    pair_gain : fall in deviance for each effect of a pair, pair_lead : its lead before other pairs,
        pair_adequacy : probability that its fit needs; these are stricter than those of single
        effects, as it is the best of some dozens of pairs.
    second : fall in deviance by a second effect from which the first is not the whole story.
    scatter : probability that fresh runs need of scattering as much as they do if replicates of the
        laboratory scatter alike.
    grown : times what noise would leave, to which the gap on data held out may grow.
    shared : times as large as stated that the errors which observables share may be, with the gap
        still there: laboratories know them within a factor of two (explanations.KNOWN_WITHIN).
    """

    p_effect: float = 0.02
    p_chi2: float = 0.005
    adequacy: float = 0.02
    fit: float = 0.2
    posterior: float = 0.9
    lead: float = 6.0
    errors: float = 2.0
    reach: float = 2.0
    ghost: float = 0.25
    ghost_of_few: float = 0.05
    few: int = 10
    coverage: float = 0.95
    held_out: float = 0.02
    pair_gain: float = 9.0
    pair_lead: float = 4.6
    pair_adequacy: float = 0.1
    second: float = 12.0
    scatter: float = 0.001
    grown: float = 2.0
    shared: float = 2.0
