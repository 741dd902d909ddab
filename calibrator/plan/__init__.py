"""Phase 1, the database: which runs, with which seeds, and what they will cost.

design        grids and Sobol sequences
requests      the runs of a case
seeds         the range of seeds of each kind of run
adaptive      the next run, chosen by what the earlier ones say
out_of_reach  by how much the targets stay out of its reach
forecast      the verb `plan`
run           the verbs `run` and `collect`
outcome       what these verbs found
"""
