"""Phase 3: fresh runs against what the interpolant promised and what was measured.

comparison   one response at one candidate
verify       the verbs `verify` and `validate`
curve        a curve as a whole
outcome      what they found
"""
