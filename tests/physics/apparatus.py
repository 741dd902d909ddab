"""What every experiment is built of: a scene, grains, floors, and steps."""

import math

import contract
import material
import session
import stop
from yade import InteractionLoop, NewtonIntegrator, O, utils

SETUP = "conical_pile"  # any set-up would do: the parameters of the contact law are common to all
FAR = 0.2  # half width [m] of a floor: no grain reaches its rim


def scene(gravity=True, **given):
    """An empty scene with the project's engines; returns parameters, grain and wall material."""
    O.reset()
    p = contract.checked(SETUP, given)
    grain, wall = session.start(p)
    if not gravity:
        engine(NewtonIntegrator).gravity = (0, 0, 0)
    return p, grain, wall


def engine(kind):
    """The engine of that class in the current scene."""
    return next(e for e in O.engines if isinstance(e, kind))


def functor_of(one, other):
    """The functor by which YADE makes the contacts of two materials."""
    return engine(InteractionLoop).physDispatcher.dispFunctor(one, other)


def run(seconds, look=lambda: None):
    """Step for a simulated time [s], with look() called after every step."""
    end = O.time + seconds

    def at_end():
        look()
        return O.time >= end

    stop.run_until(at_end, O.dt, 2 * seconds, "experiment")


def add_grain(p, z, grain, radius=None, velocity=(0, 0, 0), spin=(0, 0, 0), fixed=False):
    """A grain on the z axis; returns its body.

    A fixed grain moves with the given velocities whatever acts on it.
    """
    body = utils.sphere((0, 0, z), radius or p["particle_radius"], material=grain, fixed=fixed)
    body.state.vel, body.state.angVel = velocity, spin
    return O.bodies[O.bodies.append(body)]


def add_floor(kind, wall, edge=0.0):
    """A floor at z = 0: one wall, one large facet, or two coplanar facets.

    The facets' shared edge meets the x axis at `edge` [m]. That edge is square to the x axis
    ("edge") or at 45 degrees to it ("oblique edge").
    """
    if kind == "wall":
        return O.bodies.append(utils.wall(0.0, axis=2, sense=1, material=wall))
    lean = FAR if kind == "oblique edge" else 0.0
    a, b = (edge - lean, -FAR, 0), (edge + lean, FAR, 0)
    corners = [[a, b, (-2 * FAR, 0, 0)], [a, b, (2 * FAR, 0, 0)]]
    if kind == "facet":
        corners = [[(-FAR, -FAR, 0), (FAR, -FAR, 0), (0, FAR, 0)]]
    return O.bodies.append([utils.facet(c, material=wall) for c in corners])


def contacts(body):
    """The contacts of a body that carry a force."""
    return [i for i in body.intrs() if i.isReal]


def grain_weight(p):
    """Weight of a grain [N]."""
    return material.grain_mass(p) * material.GRAVITY


def static_overlap(p, load, effective_radius):
    """Overlap [m] at which the Hertz force 4/3 E* sqrt(R_eff) delta^1.5 is the load [N]."""
    e_star = p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))
    return (load / (4 / 3 * e_star * math.sqrt(effective_radius))) ** (2 / 3)


def effective_radius(p, partner):
    """R_eff [m] of a grain with an equal grain or with a floor."""
    return p["particle_radius"] / (2 if partner == "grain" else 1)
