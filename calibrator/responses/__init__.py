"""From records to responses at any parameter set, and from those to targets and objectives.

table             parameter points and raw responses as arrays
interpolant       what the two interpolants have in common
multilinear       on a full grid, as in the reference paper
gaussian_process  on any design, with the seed noise
kernel            its covariance, and the likeliest one
cautious          either, with errors that left-out runs bear out and possible means
coordinates       similarity: the particle density taken out
fit               the interpolant that a case asks for
box               filling the box of parameters, and staying in it
targets           errors of targets, and what counts as met
objectives        O1, O2 and others
"""
