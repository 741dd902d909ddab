"""Phase 2, the optimisation: from the database to the Pareto front and what the data pins down.

nsga2            the genetic search
front            spread individuals and the compromise
reach            targets that no parameter set meets
identifiability  profile likelihood
descent          least squares, many descents at once
sensitivity      Sobol indices
calibrate        the verb `calibrate`
outcome          what it found
parts            of what it found
"""
