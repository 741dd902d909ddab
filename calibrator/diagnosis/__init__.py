"""The missing effect: whether there is a gap, what explains it, and whether it goes away.

experiments   set-ups under conditions, and the runs that imitate them
observed      records, averages and the covariance of the measurements
surfaces      response surfaces over parameters and effects
gap           fingerprints, detection, chance
explanations  the fit of the model as it is, or with effects
rivals        all explanations side by side
metrology     errors of the measurement as rivals of an effect
limits        whether the model fits within its bounds
rule          the thresholds of a verdict
verdict       what the evidence allows to say
runs          carrying out the runs of a diagnosis
basis         what an outcome was computed from, as a fingerprint
outcome       what the verbs found, as values
sentence      the verdict in words
preflight     the verb `preflight`
confirm       fresh runs at the explanations
new_case      a named effect as a case file
diagnose      the verb `diagnose`
"""
