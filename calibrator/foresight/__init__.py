"""What can be known of a case before a run is made: the verb `check` says it.

values       every value of every set-up, with where it comes from
impossible   what a later verb, or YADE's scripts, would refuse
steps        doubts about time steps
smallest     vessels too small for what is measured in them
implausible  what can be run, and is hardly meant
"""
