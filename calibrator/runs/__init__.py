"""YADE, driven and believed: from requests to records that answer them.

request      one run, its content-addressed id, and yade-batch tables
record       what a run left, believed only where it is complete and answers the request
database     finished runs as CSV
folder       the folder of the runs
failures     what became of runs that left no record
batch        what every engine shares: pending runs, time limits, progress
local        the engine of this machine
slurm        the engine of a cluster
setups       one entry for each set-up: cost, outline, preconditions
cost         predicted core-seconds
workspace    a case and the folder of its results
"""
