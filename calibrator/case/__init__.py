"""What is asked: a case file and its lab file, read into values that cannot be invalid.

vocabulary   every name, unit, range and default, from the scripts' contract
values       single values and names, checked against it
experiment   what one run simulates: a set-up as it is or under a condition
problem      parameters with bounds, targets, and what is fixed
lab          measured responses, and the errors of the metrology
settings     the tables of a case file: plan, interpolation, search, runs, diagnosis
case         all of these in one value
toml         from the case file to that value
codec        values from and to TOML tables and JSON
physics      the formulas of the contact that both Pythons know
"""
