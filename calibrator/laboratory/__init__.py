"""Raw data of a laboratory, measured as simulations are, and made rows of the lab file.

units       units as they are written, and their factors
tables      two columns of numbers, of several repeats
scripts     the scripts' own measurements
discharge   the log of a scale
profile     position and height of a surface
picture     what of a picture is sand (the only place that needs scikit-image)
camera      pixels and lengths, tilt and roll
drum, photo the surface in a photograph
readings    single numbers
curve       the mean of repeats' curves
rows        mean, scatter and replicates; into the lab file
outcome     what is printed
verb        arguments of the verb `measure`
"""
