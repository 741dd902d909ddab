"""Up to which step a held grain comes to rest: the stability of the damped contact."""

import material
import stop
from apparatus import add_grain, scene
from yade import O

OVERLAP = 0.05  # of both contacts, in radii


def _grows(mode, restitution, step):
    """Whether a small motion of a grain between two that are held grows."""
    p, grain, _ = scene(
        gravity=False,
        restitution=restitution,
        sliding_friction=1.0,
        rolling_friction=0.0,
        time_step=step,
    )
    r = p["particle_radius"]
    for side in (-1, 1):
        add_grain(p, side * (2 - OVERLAP) * r, grain, fixed=True)
    body = add_grain(p, 0, grain)
    O.step()  # the contacts are made
    small, seen = 1e-9 * r / step, []
    if mode == "normal":
        body.state.vel = (0, 0, small)
    else:
        body.state.angVel = (0, small / r, 0)

    def look():
        seen.append(abs(body.state.vel[2]) if mode == "normal" else abs(body.state.angVel[1]) * r)
        return len(seen) >= 300 or seen[-1] > 1e3 * small

    stop.run_until(look, step, 1e3 * step, "held grain")
    half = len(seen) // 2
    return max(seen[half:]) > max(seen[:half])


def largest_stable_step(mode, restitution):
    """By bisection, for a grain that moves along its contacts ("normal") or turns ("spin")."""
    p, _, _ = scene(restitution=restitution)
    low, high = 0.0, 4 * material.rayleigh_time(p)
    for _ in range(9):
        middle = (low + high) / 2
        low, high = (low, middle) if _grows(mode, restitution, middle) else (middle, high)
    return dict(
        parameters=p,
        overlap=OVERLAP * p["particle_radius"],
        betan=material.damping_ratio(restitution),
        stable=low,
        unstable=high,
    )


def damped_steps():
    """The scripts' step [s] at restitutions, of soft grains and of stiff ones."""
    rows = []
    for young_modulus in (1e6, 1e9):
        for restitution in (0.3, 0.4, 0.5, 0.6, 0.9):
            p, _, _ = scene(young_modulus=young_modulus, restitution=restitution)
            crossing = material.rayleigh_time(p)
            rows.append(dict(parameters=p, time_step=O.dt, rayleigh=crossing))
    return rows
