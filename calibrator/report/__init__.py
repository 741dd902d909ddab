"""The page: it reads outcomes and records, and computes nothing that a verb has not noted.

page         the verb `report`
answer       what to use, and what is doubtful
calibration  the interpolant and the search
model        grains, contact law, time step, cost of a run
methods      a text for a paper with its own numbers, and what to cite
seen         what the figures show, in words
runs         pictures, verification, validation, curves
diagnosis    the page of a diagnosis; verdict its first screen, diagnosis_seen its figures in words
beside       links between the two pages
provenance   failures, versions, cost, the case file
findings     what the page reads
html, words  pieces of a page
figures      plain functions from arrays to figures
"""
