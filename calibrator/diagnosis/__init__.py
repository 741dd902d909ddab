"""The missing effect: is there a gap, which effect explains it, and does it go away?

experiments   set-ups under conditions, and the runs that imitate them
observed      records, averages and the covariance of the measurements
surfaces      response surfaces over parameters and effects
gap           fingerprints, detection, chance
explanations  the fit of each effect, and its rivals
verdict       what the evidence allows to say
runs          carrying out the runs of a diagnosis
preflight     the verb `preflight`
diagnose      the verb `diagnose`
new_case      a named effect as a case file
sentence      the verdict in words
outcome       what these verbs found
"""
