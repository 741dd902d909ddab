"""The chosen material for a scene of somebody's own, in YADE and in other engines.

names      the engines
chosen     which parameter set, and how far it was verified
contact    what every engine needs of it: stiffnesses, steps
measured   by how much engines were seen to differ at equal parameters
unmapped   what of the material an engine's file does not hold
source     functions of the YADE scripts, copied word for word
wording    the head that all files share
yade, liggghts, lammps, tables   the files
export     the verb `export`
card       a material card as a value; family, scope: two of its parts
card_page  the card as a page
write_card the verb `card`
"""
