"""YADE, driven and believed: from requests to records that answer them.

request      one run, its content-addressed id, and yade-batch tables
record       what a run left, believed only where it is complete and answers the request
database     finished runs as CSV
folder       the folder of the runs
failures     what became of runs that left no record
batch        what engines share: pending runs, time limits, progress
engine       what an engine is, and how runs are carried out by any of them
local        the engine of this machine
slurm        the engine of a cluster
engines      the engines by name
setups       one entry for each set-up: cost, outline, preconditions
cost         predicted core-seconds
workspace    a case and the folder of its results
"""
