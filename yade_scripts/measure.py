"""Bulk responses from grain positions and mass-time curves.

Pure numpy: importable without YADE, and tested on shapes whose answer can be written down.
All angles are in degrees, everything else in SI units.

The free surface is *scanned*, as a laser would: `height_map` gives, on a fine raster, the height of
the highest grain surface under each pixel. Every angle is a straight line fitted to a profile of
that map.
"""

import numpy as np

PIXELS_PER_DIAMETER = 6


def height_map(centres, radius, half_x, half_y, period_y=None):
    """Scan the heap from above.

    centres : (n, 3) array of grain centres [m]; radius : grain radius [m] (scalar or (n,));
    half_x, half_y : the raster covers [-half_x, half_x] x [-half_y, half_y] [m];
    period_y : period in y [m] where the set-up is periodic front and back.
    Returns x (nx,), y (ny,) pixel centres and height (nx, ny) [m], 0 where no grain lies.
    """
    centres = np.asarray(centres, float).reshape(-1, 3)
    radii = np.broadcast_to(np.asarray(radius, float), len(centres))
    pixel = 2 * float(np.median(radii)) / PIXELS_PER_DIAMETER if len(centres) else half_x / 10
    x, y = pixel_centres(half_x, pixel), pixel_centres(half_y, pixel)
    height = np.zeros((len(x), len(y)))
    if period_y is not None and len(centres):
        reach = radii.max() * np.array([0.0, 1.0, 0.0])
        low, high = centres[:, 1] < -half_y + reach[1], centres[:, 1] > half_y - reach[1]
        shift = np.array([0.0, period_y, 0.0])
        radii = np.concatenate([radii, radii[low], radii[high]])
        centres = np.concatenate([centres, centres[low] + shift, centres[high] - shift])
    for (cx, cy, cz), r in zip(centres, radii, strict=True):
        i0, i1 = np.searchsorted(x, [cx - r, cx + r])
        j0, j1 = np.searchsorted(y, [cy - r, cy + r])
        under = r * r - (x[i0:i1, None] - cx) ** 2 - (y[None, j0:j1] - cy) ** 2
        cap = np.where(under > 0, cz + np.sqrt(np.maximum(under, 0)), 0.0)
        np.maximum(height[i0:i1, j0:j1], cap, out=height[i0:i1, j0:j1])
    return x, y, height


def pixel_centres(half, pixel):
    count = max(4, int(np.ceil(2 * half / pixel)))
    edges = np.linspace(-half, half, count + 1)
    return 0.5 * (edges[1:] + edges[:-1])


def filled_volume(x, y, height, inside):
    """Volume under the scanned surface [m3];

    `inside` (nx, ny) marks the pixels of the vessel's cross-section.
    """
    pixel_area = (x[1] - x[0]) * (y[1] - y[0])
    return float(height[inside].sum() * pixel_area)


def radial_profile(x, y, height, width, sector=None):
    """Azimuthal mean of a height map in rings of the given width [m].

    `sector` (nx, ny) of booleans restricts it to part of the raster. Returns ring radii and mean
    heights (k,).
    """
    rho = np.hypot(x[:, None], y[None, :])
    keep = rho < min(x.max(), y.max()) if sector is None else sector & (rho < min(x.max(), y.max()))
    return _binned(rho[keep], height[keep], width)


def x_profile(x, height, width):
    """Mean over y of a height map in slabs of the given width [m] along x; returns (k,), (k,)."""
    return _binned(x, height.mean(axis=1), width)


def _binned(position, value, width):
    if len(position) == 0:
        return np.empty(0), np.empty(0)
    index = np.floor((position - position.min()) / width).astype(int)
    count = np.bincount(index)
    full = count > 0
    centre = np.bincount(index, position)[full] / count[full]
    return centre, np.bincount(index, value)[full] / count[full]


def fit_slope(position, height, rising=False):
    """Least-squares line through a profile.

    Returns angle [deg], its standard error [deg] (scatter of the profile about the line, delta
    method), curvature [1/m] (second derivative of the fitted parabola) and intercept [m]; None
    where fewer than four points are given. The angle is positive where the surface falls outwards,
    as a heap does, or with `rising` where it rises, as a crater does; the other way round it is
    negative: a dome is no crater of the same angle.
    """
    if len(position) < 4:
        return None
    (slope, intercept), covariance = np.polyfit(position, height, 1, cov=True)
    curvature = 2 * np.polyfit(position, height, 2)[0]
    error = np.sqrt(covariance[0, 0]) / (1 + slope**2)
    return dict(
        angle=float(np.degrees(np.arctan(slope if rising else -slope))),
        error=float(np.degrees(error)),
        curvature=float(curvature),
        intercept=float(intercept),
        slope=float(slope),
    )


def asymmetry(
    x, y, height, width, part, cut=lambda position, profile: (position, profile), rising=False
):
    """Half the difference of the slope angles [deg] on the +x and -x sides of a round heap.

    part (nx, ny) marks the pixels that belong to the slope; cut takes and returns (position,
    profile) before the fit; rising as for `fit_slope`. None where one side has too few rings.
    """
    sides = [part & (x > 0)[:, None], part & (x < 0)[:, None]]
    profiles = [cut(*radial_profile(x, y, height, width, side)) for side in sides]
    fits = [fit_slope(*profile, rising=rising) for profile in profiles]
    return 0.5 * (fits[0]["angle"] - fits[1]["angle"]) if all(fits) else None


def between_heights(position, height, low, high):
    """The outward part of a profile with heights between two shares of its maximum.

    Cuts off the rounded apex and the thin toe of a heap before a line is fitted.
    """
    top = int(np.argmax(height))
    share = height / height[top] if height[top] > 0 else np.zeros_like(height)
    keep = (np.arange(len(height)) >= top) & (share >= low) & (share <= high)
    return position[keep], height[keep]


def flank(position, height):
    """The straight part of a heap's profile: neither the rounded apex nor the thin toe."""
    return between_heights(position, height, 0.2, 0.8)


def pile_responses(x, y, height, width):
    """Responses of a scanned round heap, about the middle of the raster.

    width [m] of the rings. Returns the responses, and the radial profile: positions and heights
    (k,) [m].
    """
    responses = dict(pile_equivalent_angle_deg=cone_angle_from_moments(x, y, height))
    position, profile = radial_profile(x, y, height, width)
    fit = fit_slope(*flank(position, profile))
    if fit:
        responses.update(
            pile_angle_of_repose_deg=fit["angle"],
            pile_angle_error_deg=fit["error"],
            pile_curvature=fit["curvature"],
            pile_apex_rounding=fit["intercept"] - float(profile.max()),
        )
        tilt = asymmetry(x, y, height, width, np.ones_like(height, bool), flank)
        if tilt is not None:
            responses["pile_asymmetry_deg"] = tilt
    return responses, position, profile


def ledge_responses(position, height):
    """Responses of the profile (k,) [m] of a slope that falls from a back wall at position 0.

    The layered grains at the back wall, a flat that the slide did not reach, and the ragged edge
    are left out.
    """
    fit = fit_slope(*between_heights(position, height, 0.2, 0.9))
    if not fit:
        return {}
    return dict(
        ledge_angle_of_repose_deg=fit["angle"],
        ledge_angle_error_deg=fit["error"],
        ledge_curvature=fit["curvature"],
    )


def crater_responses(x, y, height, neck_radius, cylinder_radius, grain_radius):
    """Responses of the scanned crater that a discharge leaves in a flat-bottomed cylinder.

    One grain diameter at the neck (its edge is ragged) and one at the wall (grains stand in layers
    there) are left out.
    """
    rho = np.hypot(x[:, None], y[None, :])
    part = (rho > neck_radius + 2 * grain_radius) & (rho < cylinder_radius - 2 * grain_radius)
    ring = grain_radius / 2
    fit = fit_slope(*radial_profile(x, y, height, ring, part), rising=True)
    if not fit:
        return {}
    responses = dict(
        drained_angle_of_repose_deg=fit["angle"],
        drained_angle_error_deg=fit["error"],
        drained_curvature=fit["curvature"],
    )
    tilt = asymmetry(x, y, height, ring, part, rising=True)
    if tilt is not None:
        responses["drained_asymmetry_deg"] = tilt
    return responses


def crater_angle_from_volume(volume, cylinder_radius, neck_radius):
    """Angle [deg] of the cone-shaped crater that leaves `volume` [m3] in a flat-bottomed cylinder.

    The surface rises from the edge of the neck a to the wall R as (rho - a) tan(theta), so
    V = 2 pi tan(theta) [(R^3 - a^3)/3 - a (R^2 - a^2)/2].
    """
    R, a = cylinder_radius, neck_radius
    return float(
        np.degrees(np.arctan(volume / (2 * np.pi * ((R**3 - a**3) / 3 - a * (R**2 - a**2) / 2))))
    )


def wedge_angle_from_volume(volume, length, width):
    """Angle [deg] of the wedge of length L and width W that holds `volume` [m3]:

    V = W L^2 tan(theta)/2.
    """
    return float(np.degrees(np.arctan(2 * volume / (width * length**2))))


def cone_angle_from_moments(x, y, height):
    """Angle [deg] of the cone with the same volume and the same height moment as the scanned heap.

    A cone of height h has its centre of mass at h/4; with V = pi R^2 h/3 this gives tan(theta) =
    h/R.
    """
    pixel_area = (x[1] - x[0]) * (y[1] - y[0])
    volume = height.sum() * pixel_area
    h = 4 * (0.5 * (height**2).sum() * pixel_area) / volume
    return float(np.degrees(np.arctan(h / np.sqrt(3 * volume / (np.pi * h)))))


def discharge_features(time, mass):
    """Features of the mass-time curve of a discharge.

    time (n,) [s] since the plug was removed; mass (n,) [kg] that has passed the neck,
    non-decreasing. Returns mass_flow_rate [kg/s], late_early_ratio, onset_delay [s],
    rate_fluctuation and emptying_time [s]; an empty dict where less than ten samples lie on the
    steady part.
    """
    time, mass = np.asarray(time, float), np.asarray(mass, float)
    share = mass / mass[-1] if mass[-1] > 0 else mass

    def line(low, high):
        keep = (share >= low) & (share <= high)
        if keep.sum() < 10:
            return None
        slope, intercept = np.polyfit(time[keep], mass[keep], 1)
        return slope, intercept, np.std(mass[keep] - slope * time[keep] - intercept)

    steady, early, late = line(0.20, 0.70), line(0.15, 0.45), line(0.50, 0.80)
    if steady is None or early is None or late is None:
        return {}
    rate, intercept, scatter = steady
    return dict(
        mass_flow_rate=float(rate),
        late_early_ratio=float(late[0] / early[0]),
        onset_delay=float(-intercept / rate),
        rate_fluctuation=float(scatter / mass[-1]),
        emptying_time=float(time[np.searchsorted(share, 0.95)]),
    )


DRUM_PARTS = {
    "drum_angle_deg": (-0.5, 0.5),
    "drum_central_angle_deg": (-0.2, 0.2),
    "drum_upper_angle_deg": (-0.7, -0.3),
    "drum_lower_angle_deg": (0.3, 0.7),
}
DRUM_HEIGHTS = {
    "drum_height_upper_06": -0.6,
    "drum_height_upper_03": -0.3,
    "drum_height_centre": 0.0,
    "drum_height_lower_03": 0.3,
    "drum_height_lower_06": 0.6,
}


def falling_right(x, z):
    """A profile (n,), seen from the side from which it falls towards +x."""
    return (-x[::-1], z[::-1]) if np.polyfit(x, z, 1)[0] > 0 else (x, z)


def drum_responses(x, z, drum):
    """Responses of the surface in a rotating drum.

    x, z : (n,) from the drum's axis, to the right and up, x rising, in the unit of its radius
    `drum`; the surface falls to the right. Returns the responses, and the standard errors of the
    fitted slopes [deg]; empty where the surface does not cross the drum.
    """
    inner = np.abs(x) < 0.7 * drum
    if inner.sum() < 8 or x.min() > -0.5 * drum or x.max() < 0.5 * drum:
        return {}, {}
    found, errors = {}, {}
    for name, (low, high) in DRUM_PARTS.items():
        part = (x > low * drum) & (x < high * drum)
        fit = fit_slope(x[part], z[part])
        if fit is None:
            return {}, {}
        found[name], errors[name] = fit["angle"], fit["error"]
    terms = np.polyfit(x[inner] / drum, z[inner] / drum, 3)
    found.update({"drum_cubic_%d" % (3 - i): float(term) for i, term in enumerate(terms)})
    heights = np.interp([share * drum for share in DRUM_HEIGHTS.values()], x, z) / drum
    for (name, share), height in zip(DRUM_HEIGHTS.items(), heights, strict=True):
        if x[0] <= share * drum <= x[-1]:
            found[name] = float(height)
    found["drum_filled_share"] = filled_share(x, z, drum)
    return found, errors


def filled_share(x, z, drum):
    """Share of a drum's section below its surface (n,), which goes on straight to the shell."""
    across = np.linspace(-drum, drum, 2001)
    rim = np.sqrt(np.maximum(drum**2 - across**2, 0))
    height = np.interp(across, x, z)
    for end in (0, -1):
        near = np.abs(x - x[end]) < 0.15 * drum
        slope = np.polyfit(x[near], z[near], 1)[0] if near.sum() > 1 else 0.0
        beyond = across < x[0] if end == 0 else across > x[-1]
        height[beyond] = z[end] + slope * (across[beyond] - x[end])
    filled = np.clip(height, -rim, rim) + rim
    return float(filled.sum() / (2 * rim).sum())


def drum_blur(outer, inner, drum, angle_deg):
    """Thickness of a surface's blur, square to it, within half the radius.

    outer, inner : the profiles (x, z) at which the time average shows grains 16 and 84 % of the
    time; angle_deg : slope of the surface. None where one of the two is not there.
    """
    middle = np.linspace(-0.5 * drum, 0.5 * drum, 101)
    if any(len(x) < 2 or x[0] > -0.5 * drum or x[-1] < 0.5 * drum for x, _ in (outer, inner)):
        return None
    apart = np.mean(np.interp(middle, *outer) - np.interp(middle, *inner))
    return float(apart * np.cos(np.radians(angle_deg)))


def steadiness(angles):
    """Drift over a series (n,) of block means, its standard error, and that of their mean.

    The drift is that of the line fitted to the series; the errors come from the scatter about the
    line, so that a drift does not hide in the scatter that it makes.
    """
    angles = np.asarray(angles, float)
    n = len(angles)
    at = np.arange(n) - (n - 1) / 2
    slope = float(at @ angles / (at @ at))
    scatter = np.sqrt(np.sum((angles - angles.mean() - slope * at) ** 2) / max(n - 2, 1))
    return slope * n, float(scatter * n / np.sqrt(at @ at)), float(scatter / np.sqrt(n))
