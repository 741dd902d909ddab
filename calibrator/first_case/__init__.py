"""A case of somebody's own: from answers to a case file and a lab file that `check` accepts.

answers : what was asked and said, from a file, from options or from a terminal (`questions`).
grains : which parameters a material leaves open, and their bounds.
vessels : what a smaller vessel leaves of each measurement.
knowledge : what each response says of the frictions, and which further one would say most.
sizing : the largest vessels and the design that the budget pays for.
files : the two files, with comments. verb : the verb `init` itself.
"""
