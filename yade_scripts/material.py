"""Hertz-Mindlin contacts with elastic-plastic rolling resistance in YADE.

This is the only place where friction coefficients become YADE's numbers. Three facts shape it:

* YADE caps the rolling moment at eta * R_mean * |F_n|, the literature (and LIGGGHTS) at mu_r *
  R_eff * |F_n| with R_eff = R1 R2/(R1 + R2). For two grains R_mean = (R1 + R2)/2, so eta = 2 R1
  R2/(R1 + R2)^2 mu_r, which is mu_r/2 for equal grains. At a wall R_eff = R, but a Hertzian wall
  enters YADE's mean as a sphere of 1e8 R, so eta = 2/(1e8 + 1) mu_r there.
* eta is one number per contact functor, and only one class of functors with an eta is in every
  build of YADE. Grains and walls therefore have materials of different *classes*, FrictMatCDM (a
  FrictMat, taken for nothing but its class) and FrictMat, and YADE's class dispatch is led to one
  functor for two grains and to another one of the same class for all else: see `dispatch`.
* YADE's damped contact ends with a stretch where the damping would pull; there YADE sets F_n = 0,
  and where F_n = 0 it skips the cap, so that for the last steps of every collision the stiff
  rolling spring is unlimited (tests/physics measures the spin lost in an impact). With an adhesion,
  however small, YADE drops the damping on that stretch instead, F_n stays positive and the cap
  holds. YADE's own fit en -> betan does not know this branch, so betan is found here by integrating
  the impact.

Rolling stiffness: YADE's krot is an absolute stiffness in N m/rad that does not follow the load.
The default "epsd2" takes the rule k_r = k_t R_eff^2 of that model at a typical static load of five
grain weights, with k_t the Hertz-Mindlin shear stiffness, times the column rolling_stiffness_ratio.
"epsd" is the soft spring 2.25 k_n mu_r^2 R_eff^2 of the older model at the same load; it gives
flatter heaps, so results of the two must not be mixed.
"""

import contextlib
import math

from yade import FrictMat, FrictMatCDM, Ip2_FrictMat_FrictMat_MindlinPhys, IPhysFunctor

GRAVITY = 9.81
WALL_RADIUS_RATIO = 1e8
LARGEST_STEP_SHARE = 0.28
# of the damped step of a grain on a shear spring, and times its damping ratio: found on poured beds
# (benchmarks/runs/damped_step.py)
LARGEST_DAMPED_SHARE, CROWD = 0.8, 6.0
# kinetic energy over m g d: grains that still rock, in a heap that no longer moves
FILLING_ENERGY_RATIO = 5e-4
SIZE_CLASSES = 7
# pull-off force over grain weight: far too small to matter, it only selects YADE's branch
TOKEN_ADHESION = 1e-9


def grain_mass(p):
    """Mass of one grain [kg]."""
    return 4 / 3 * math.pi * p["particle_radius"] ** 3 * p["particle_density"]


def size_list(text):
    """Diameters and number shares (n, 2) of a size_distribution such as 1.05:0.2|1.1:0.8."""
    return [[float(number) for number in part.split(":")] for part in text.split("|")]


def size_classes(p):
    """Radii [m] of the sizes of grains: one, the given ones, or SIZE_CLASSES in equal steps.

    The given ones are scaled to a mean of particle_radius; the coefficient of variation of the
    steps is size_spread exactly.
    """
    spread, given = p["size_spread"], p.get("size_distribution")
    if given:
        sizes = size_list(given)
        mean = sum(d * share for d, share in sizes) / sum(share for _, share in sizes)
        return [p["particle_radius"] * d / mean for d, _ in sizes]
    if spread == 0:
        return [p["particle_radius"]]
    steps = [i - (SIZE_CLASSES - 1) / 2 for i in range(SIZE_CLASSES)]
    deviation = math.sqrt(sum(s * s for s in steps) / SIZE_CLASSES)
    return [p["particle_radius"] * (1 + spread * s / deviation) for s in steps]


def size_shares(p):
    """How frequent each of those sizes is, their sum being anything."""
    given = p.get("size_distribution")
    return [share for _, share in size_list(given)] if given else [1] * len(size_classes(p))


def clump_radius(p):
    """Radius [m] of a clump's two spheres, whose union has the volume of a grain.

    Spheres of radius R at a distance 2 R (a - 1): V = 4/3 pi R^3 (1 + 3/2 c - 1/2 c^3) with c = a -
    1.
    """
    c = p["clump_aspect"] - 1
    return p["particle_radius"] / (1 + 1.5 * c - 0.5 * c**3) ** (1 / 3)


def clump_inertia(p):
    """Moments of inertia [kg m2] of such a clump about its axis and across it.

    By discs: the outline is that of the sphere at +h beyond the middle plane, and mirrored, with h
    = R c half the distance.
    """
    radius, steps = clump_radius(p), 2000
    half = radius * (p["clump_aspect"] - 1)
    dz = (half + radius) / steps
    along = across = 0.0
    for i in range(steps):
        z = (i + 0.5) * dz
        square = max(radius**2 - (z - half) ** 2, 0.0)
        disc = 2 * p["particle_density"] * math.pi * square * dz
        along += disc * square / 2
        across += disc * (square / 4 + z * z)
    return along, across


def smallest_radius(p):
    """Radius [m] of the smallest sphere in the scene."""
    return clump_radius(p) if p["clump_aspect"] > 1 else min(size_classes(p))


def largest_reach(p):
    """Distance [m] from its centre that no part of any grain exceeds."""
    return clump_radius(p) * p["clump_aspect"] if p["clump_aspect"] > 1 else max(size_classes(p))


def mean_grain_mass(p):
    """Mean mass of the grains [kg].

    The mean of (1 + cv z)^3 over sizes z symmetric about 0 with variance 1 is 1 + 3 cv^2.
    """
    if p.get("size_distribution"):
        sizes = list(zip(size_classes(p), size_shares(p), strict=True))
        cubes = sum(share * r**3 for r, share in sizes) / sum(share for _, share in sizes)
        return 4 / 3 * math.pi * cubes * p["particle_density"]
    return grain_mass(p) * (1 + 3 * p["size_spread"] ** 2)


def rayleigh_time(p):
    """T_R = pi r sqrt(rho/G)/(0.163 nu + 0.8766) [s], Eq.

    (2) of the reference paper; G = E/(2 (1 + nu)).
    """
    shear = p["young_modulus"] / (2 * (1 + p["poisson_ratio"]))
    root = math.sqrt(p["particle_density"] / shear)
    return math.pi * p["particle_radius"] * root / (0.163 * p["poisson_ratio"] + 0.8766)


def time_step(p):
    """The fixed step [s] of the request, else its share of the Rayleigh time, or less if needed.

    The fraction bounds the error of single impacts. For grains that are soft for their weight
    another limit comes first: single grains between two others rock and never come to rest. It goes
    with the period of a grain on the springs of its resting contacts, and was found by trial
    (benchmarks/runs/step_limit.py). For inelastic grains it is the damping (damped_step).
    """
    p = dict(p, particle_radius=smallest_radius(p))  # the smallest spheres are the fastest
    inertia = 0.4 * grain_mass(p) * p["particle_radius"] ** 2
    largest = LARGEST_STEP_SHARE * math.sqrt(inertia / turning_spring(p))
    fraction = p["rayleigh_fraction"] * rayleigh_time(p)
    return p["time_step"] or min(fraction, largest, damped_step(p))


def damped_step(p):
    """Longest step [s] at which the damping of contacts does not shake a bed.

    YADE takes forces from the velocity of half a step before. An oscillator with frequency omega
    and damping ratio zeta then is stable for omega dt < 2 (sqrt(1 + zeta^2) - zeta), which
    tests/physics finds on a held grain, and first for its spin: YADE caps the elastic shear force
    of a contact by friction, but not the damping beside it. In a bed a grain is damped by all its
    contacts at once: zeta = CROWD betan, and omega that of its spin on one shear spring k_t r^2
    under five grain weights, over a factor. Both were found by trial, and hold from a restitution
    of 0.3 up (benchmarks/runs/damped_step.py).
    """
    radius, zeta = p["particle_radius"], CROWD * damping_ratio(p["restitution"])
    inertia = 0.4 * grain_mass(p) * radius**2
    # 4 k_t (r/2)^2 = k_t r^2
    spring = stiff_rolling_spring(dict(p, rolling_stiffness_ratio=4.0), radius / 2)
    free = math.sqrt(inertia / spring)
    return LARGEST_DAMPED_SHARE * free * (math.sqrt(1 + zeta * zeta) - zeta)


def random_speed(p):
    """Scale [m/s] of the random part of a grain's first velocity, in each direction."""
    return 0.5 * (GRAVITY * 2 * p["particle_radius"]) ** 0.5


def possible_speed(p, height):
    """Speed [m/s] that no grain exceeds by much which starts a filling at up to a height [m].

    Its start, the fall, and twice the speed of a set-up that vibrates.
    """
    shaking = p.get("shaking", 0.0)
    swing = shaking * GRAVITY / (math.pi * p["shaking_frequency"]) if shaking else 0.0
    fall = (2 * GRAVITY * (1 + shaking) * height) ** 0.5
    return p["pouring_velocity"] + 3**0.5 * random_speed(p) + fall + swing


def filling_energy(p):
    """Mean kinetic energy per grain at which a filling counts as settled [J]."""
    return (
        p["filling_kinetic_energy"]
        or FILLING_ENERGY_RATIO * grain_mass(p) * GRAVITY * 2 * p["particle_radius"]
    )


def grain_eta(rolling_friction, r1=1.0, r2=1.0):
    """YADE's eta for a contact of two grains with radii r1 and r2."""
    return 2 * r1 * r2 / (r1 + r2) ** 2 * rolling_friction


def wall_eta(rolling_friction):
    """YADE's eta for a contact of a grain with a Hertzian facet or wall."""
    return 2 / (WALL_RADIUS_RATIO + 1) * rolling_friction


def rolling_stiffness(p, effective_radius):
    """krot [N m/rad] of a contact with the given R_eff [m].

    It is 0 where mu_r is 0, because YADE reads eta = 0 as no cap.
    """
    if p["rolling_friction"] == 0:
        return 0.0
    if p["rolling_spring"] == "epsd":
        normal = 4 / 3 * effective_modulus(p) * static_contact_radius(p, effective_radius)
        return 2.25 * normal * p["rolling_friction"] ** 2 * effective_radius**2
    return stiff_rolling_spring(p, effective_radius)


def effective_modulus(p):
    """E* of a contact of two equal materials [Pa]."""
    return p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))


def static_contact_radius(p, effective_radius):
    """Radius of the Hertz contact under five grain weights [m]."""
    load = 5 * grain_mass(p) * GRAVITY
    overlap = (load / (4 / 3 * effective_modulus(p) * math.sqrt(effective_radius))) ** (2 / 3)
    return math.sqrt(effective_radius * overlap)


def stiff_rolling_spring(p, effective_radius):
    """krot of "epsd2" [N m/rad]: rolling_stiffness_ratio k_t R_eff^2, with k_t = 8 G* a."""
    nu = p["poisson_ratio"]
    g_star = p["young_modulus"] / (2 * (1 + nu)) / (2 * (2 - nu))
    shear = 8 * g_star * static_contact_radius(p, effective_radius)
    return p["rolling_stiffness_ratio"] * shear * effective_radius**2


def turning_spring(p):
    """Stiffness [N m/rad] that bounds the step: half of what resists a turning grain at a contact.

    The shear spring turns it by k_t r^2, the rolling spring by its ratio times k_t r^2/4. Half,
    because LARGEST_STEP_SHARE was found with equal ones, at a ratio of 4, and is a share of
    sqrt(I/krot) there.
    """
    ratio = 0.5 * (4.0 + p["rolling_stiffness_ratio"])
    return stiff_rolling_spring(dict(p, rolling_stiffness_ratio=ratio), p["particle_radius"] / 2)


def restitution_of(betan, steps=1000):
    """Restitution of an impact: Hertz spring and damping 2 betan sqrt(m k_n).

    The damping is dropped where the sum would pull. In units where mass, F_n/delta^1.5 and impact
    speed are 1, the result depends on betan alone.
    """
    x, v, dt = 0.0, 1.0, 4.0 / steps
    while x >= 0:
        elastic = x**1.5
        force = elastic + betan * math.sqrt(6) * x**0.25 * v
        v -= dt * (force if force > 0 else elastic)
        x += dt * v
    return -v


def damping_ratio(restitution):
    """betan that gives the restitution, by bisection."""
    low, high = 0.0, 50.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
    return low


def token_adhesion(p, effective_radius):
    """YADE's gamma [J/m2]: its pull-off force is 4 pi R_eff gamma."""
    return TOKEN_ADHESION * grain_mass(p) * GRAVITY / (4 * math.pi * effective_radius)


def materials(p):
    """Grain and wall material: same elasticity and friction, other classes for the dispatch."""
    common = dict(
        young=p["young_modulus"],
        poisson=p["poisson_ratio"],
        frictionAngle=math.atan(p["sliding_friction"]),
    )
    grain = FrictMatCDM(density=p["particle_density"], label="grain", **common)
    return grain, FrictMat(label="wall", **common)


def contact_functors(p):
    """The two functors that turn materials into contacts: grain-grain and grain-wall."""
    r, betan = p["particle_radius"], damping_ratio(p["restitution"])
    between_grains = Ip2_FrictMat_FrictMat_MindlinPhys(
        betan=betan,
        eta=grain_eta(p["rolling_friction"]),
        krot=rolling_stiffness(p, r / 2),
        gamma=token_adhesion(p, r / 2),
    )
    at_walls = Ip2_FrictMat_FrictMat_MindlinPhys(
        betan=betan,
        eta=wall_eta(p["rolling_friction"]),
        krot=rolling_stiffness(p, r),
        gamma=token_adhesion(p, r),
    )
    return [between_grains, at_walls]


def dispatch(dispatcher, between_grains, at_walls):
    """Let YADE's dispatcher make contacts of two grains by one functor and all others by another.

    Both are declared for the same pair of classes, FrictMat and FrictMat, for which the dispatcher
    has one entry in its table. Asked for two grains, which are of a derived class, it copies that
    entry to one of their own, and the copy stays when the entry is replaced. Setting `functors`
    replaces it, but clears the table as its last act, so it is kept from getting there:
    IPhysFunctor, the abstract one, has no pair of classes, and YADE raises.
    Raises RuntimeError where a build of YADE works in another way: no run may go on with a wrong
    rolling cap.
    """
    grain, wall = FrictMatCDM(), FrictMat()
    dispatcher.functors = [between_grains]
    dispatcher.dispFunctor(grain, grain)
    with contextlib.suppress(RuntimeError):
        dispatcher.functors = [at_walls, IPhysFunctor()]
    pairs = ((grain, grain), (grain, wall), (wall, grain))
    if [dispatcher.dispFunctor(*pair) for pair in pairs] != [between_grains, at_walls, at_walls]:
        remedy = "use YADE 2023.02a or 2025.2.0"
        raise RuntimeError("this YADE gives grains and walls the same rolling cap: " + remedy)
