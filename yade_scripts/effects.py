"""Physical effects that a calibration may have missed: a column each, off at its default.

An effect is a small function here and an entry with an "effect" block in contract.json (name, unit,
sign, plausible scale, what would remove it in the laboratory, what it is easily mistaken for). The
function is called only where the column differs from its default, so a run with every effect off is
the same, bit for bit, as one of scripts that have never heard of it.

`@at_start` effects get the parameters and the scene's contact functors and integrator before there
are grains; `@on_grains` effects get the parameters and the ids of the grains' spheres, and return
engines that go into the loop before the integrator. Two effects reach deeper: the hourglass asks
for `true_neck`, and grains get their radii from `material.size_classes` or their two spheres from
`two_spheres`.
"""

import math

import numpy as np
from yade import LinearDragEngine, NewtonIntegrator, O, PyRunner

import contract
import material

_AT_START, _ON_GRAINS = {}, {}
_shaken = {"until": 0.0, "swing": None, "integrator": None}


def at_start(name):
    """Register function(p, between_grains, at_walls, integrator) as the effect of a column."""
    return lambda function: _AT_START.setdefault(name, function)


def on_grains(name):
    """Register function(p, ids) -> engines as the effect of a column."""
    return lambda function: _ON_GRAINS.setdefault(name, function)


def is_on(p, name):
    """Whether the column is there and differs from its default."""
    return name in p and p[name] != contract.CONTRACT["parameters"][name]["default"]


def start(p, between_grains, at_walls, integrator):
    """Apply the effects that change contacts or gravity.

    Raises BadInput for two that cannot be combined.
    """
    _shaken["until"] = 0.0
    for name, spec in contract.CONTRACT["parameters"].items():
        for other in spec.get("effect", {}).get("excludes", []):
            if is_on(p, name) and is_on(p, other):
                raise contract.BadInput(
                    "%s and %s cannot be combined: set one of them to its default" % (name, other)
                )
    for name, function in _AT_START.items():
        if is_on(p, name):
            function(p, between_grains, at_walls, integrator)


def engines(p, ids):
    """Engines of the effects that act on grains."""
    return [
        engine
        for name, function in _ON_GRAINS.items()
        if is_on(p, name)
        for engine in function(p, ids)
    ]


@at_start("bond_number")
def adhesion(p, between_grains, at_walls, integrator):
    """DMT adhesion: the pull-off force 4 pi R_eff gamma of two grains is Bo times their weight.

    Derjaguin, Muller and Toporov, J. Colloid Interface Sci. 53 (1975) 314-326. gamma is the
    material's, so at a wall, where R_eff is twice as large, so is the force.
    """
    gamma = (
        p["bond_number"]
        * material.grain_mass(p)
        * material.GRAVITY
        / (4 * math.pi * p["particle_radius"] / 2)
    )
    between_grains.gamma = at_walls.gamma = gamma


@at_start("wall_friction_ratio")
def wall_friction(p, between_grains, at_walls, integrator):
    """A friction angle of its own for contacts with walls;

    YADE would take the smaller one of the two materials'.
    """
    at_walls.frictAngle = math.atan(p["wall_friction_ratio"] * p["sliding_friction"])


@at_start("tilt_deg")
def tilt(p, between_grains, at_walls, integrator):
    """The set-up stays where it is and gravity leans, which is the same seen from inside."""
    angle = math.radians(p["tilt_deg"])
    integrator.gravity = (
        material.GRAVITY * math.sin(angle),
        0,
        -material.GRAVITY * math.cos(angle),
    )


@at_start("twisting_stiffness")
def twisting(p, between_grains, at_walls, integrator):
    """An elastic moment against twist, uncapped, so more resistance than any grain has."""
    radius = p["particle_radius"]
    between_grains.ktwist = p["twisting_stiffness"] * material.stiff_rolling_spring(p, radius / 2)
    at_walls.ktwist = p["twisting_stiffness"] * material.stiff_rolling_spring(p, radius)


@on_grains("bed_viscosity")
def air_drag(p, ids):
    """Stokes drag 6 pi eta r v; the viscosity is an effective one, see the contract.

    Both spheres of a clump share it.
    """
    share = p["particle_radius"] / (2 * material.clump_radius(p)) if is_on(p, "clump_aspect") else 1
    return [LinearDragEngine(nu=p["bed_viscosity"] * share, ids=list(ids))]


@at_start("size_spread")
@at_start("size_distribution")
def rolling_of_several_sizes(p, between_grains, at_walls, integrator):
    """Rolling cap and stiffness right in the mean over all pairs of sizes, and at each wall.

    YADE has one eta and one krot per functor. With eta = mu_r/2 the caps would all be too high, by
    ((R1 - R2)/(R1 + R2))^2; with the mean the error of a pair is within 13 % at a spread of 0.25.
    """
    sizes = list(zip(material.size_classes(p), material.size_shares(p), strict=True))
    pairs = [(a, b, v * w) for a, v in sizes for b, w in sizes]
    frequent = sum(w for _, _, w in pairs)
    between_grains.eta = (
        sum(w * material.grain_eta(p["rolling_friction"], a, b) for a, b, w in pairs) / frequent
    )
    between_grains.krot = (
        sum(w * material.rolling_stiffness(p, a * b / (a + b)) for a, b, w in pairs) / frequent
    )
    shares = sum(w for _, w in sizes)
    at_walls.krot = sum(w * material.rolling_stiffness(p, r) for r, w in sizes) / shares


@at_start("clump_aspect")
def contacts_of_clumps(p, between_grains, at_walls, integrator):
    """Rolling stiffness of the clumps' spheres, smaller than the grain; caps need no change."""
    radius = material.clump_radius(p)
    between_grains.krot, at_walls.krot = (
        material.rolling_stiffness(p, radius / 2),
        material.rolling_stiffness(p, radius),
    )


def two_spheres(p, centres, rng):
    """Centres (n, 2, 3) [m] of the spheres of clumps at centres (n, 3), turned at random."""
    axes = rng.normal(size=centres.shape)
    axes *= (
        material.clump_radius(p) * (p["clump_aspect"] - 1) / np.linalg.norm(axes, axis=1)[:, None]
    )
    return np.stack([centres - axes, centres + axes], axis=1)


def weigh_clump(p, clump, members):
    """Give a clump mass and inertia of its spheres' union, which YADE would estimate on a raster.

    The spheres get the clump's mass as well: YADE takes the damping of a contact from the mass of
    the sphere that touches, and moves the clump alone.
    """
    mass, (along, across) = material.grain_mass(p), material.clump_inertia(p)
    estimated = list(clump.state.inertia)
    axis = estimated.index(min(estimated))
    clump.state.mass = mass
    clump.state.inertia = [along if i == axis else across for i in range(3)]
    for member in members:
        member.state.mass = mass


def true_neck(p):
    """Diameter [m] of the neck as it is, not as it was measured."""
    return p["neck_diameter"] + p["neck_error"]


def shake(p):
    """Vibrate the set-up along x for a while: gravity swings, the same seen from inside."""
    if not is_on(p, "shaking"):
        return
    begin, omega = O.time, 2 * math.pi * p["shaking_frequency"]
    steer()
    still = tuple(_shaken["integrator"].gravity)
    peak = p["shaking"] * material.GRAVITY

    def swing():
        on = O.time < _shaken["until"]
        side = peak * math.sin(omega * (O.time - begin)) if on else 0.0
        _shaken["integrator"].gravity = (still[0] + side, still[1], still[2])

    _shaken.update(until=begin + p["shaking_time"], swing=swing)
    O.engines = [
        *O.engines,
        PyRunner(command="import effects; effects._shaken['swing']()", iterPeriod=1),
    ]


def steer():
    """Look for the integrator again, which in a scene that was loaded is another one."""
    (_shaken["integrator"],) = (e for e in O.engines if isinstance(e, NewtonIntegrator))


def shakes():
    """Whether a vibration is still on."""
    return O.time < _shaken["until"]
