"""Two frictions and two densities as targets."""

from calibrator.case.problem import Parameter, Problem, Target

PARAMETERS = (Parameter("rolling_friction", 0.0, 1.0), Parameter("sliding_friction", 0.0, 1.0))
KEYS = ["hourglass.bulk_density", "ledge.bulk_density"]


def problem(first=100.0, second=200.0, **options):
    return Problem(
        PARAMETERS,
        (
            Target("hourglass", "bulk_density", first, **options),
            Target("ledge", "bulk_density", second, **options),
        ),
    )
