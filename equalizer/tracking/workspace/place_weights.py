"""Interpolation weights of scattered points at a place between them."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.optimize import nnls
from scipy.spatial import Delaunay

from equalizer.signals.signal import FloatArray
from equalizer.tracking.workspace.workspace_models import Place

FLAT = 0.05
"""Relative spread below which points are taken as flat in a direction: else the triangulation of hand-placed points
would have slivers that join distant points."""
OUTSIDE_M = 1e-3
"""Distance to the points' hull up to which a place counts as inside."""
SUM_TO_ONE = 1e6
"""Weight of the condition that weights sum to 1, against distances of order 1, in the search for the nearest point of
the hull."""

BEND = 0.35
"""Shape parameter of the radial functions times the distance between neighbours: smaller is closer to a parabola."""
ROUNDING = 1e-6
"""Weights below this are set to zero, because each point costs a computation of its forces."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaceWeights:
    """Interpolation weights at a place, of points where models were identified; result of `place_weights`."""

    linear: FloatArray
    """(points,): none negative, sum 1; linear between neighbours, continuous, exact at the points."""
    smooth: FloatArray
    """(points,): sum 1, exact at the points, and their slope is continuous; some may be negative. For quantities that
    vary smoothly with the place, such as a frequency: of second order where `linear` is of first."""
    outside_m: float
    """How far the place lies outside the points' hull; the weights are those of the nearest place inside."""

    @property
    def remark(self) -> str | None:
        """Sentence for the user on a place more than `OUTSIDE_M` outside the hull; else None."""
        if self.outside_m <= OUTSIDE_M:
            return None
        return (
            f"the place is {1e3 * self.outside_m:.1f} mm outside the points where models were identified: "
            "the nearest place between them was used"
        )


def place_weights(points_m: FloatArray, place_m: Place | FloatArray) -> PlaceWeights:
    """Weights of points_m (points, 3), all different, at a place, on their Delaunay triangulation: along a line, over a
    surface or in a volume, as the points lie. Inverse distance would have zero slope at every point."""
    points = np.asarray(points_m, dtype=np.float64)
    place = np.asarray(place_m, dtype=np.float64)
    if len(points) == 1:
        alone = np.ones(1)
        return PlaceWeights(alone, alone, float(np.linalg.norm(place - points[0])))
    centre = points.mean(axis=0)
    scale = float(np.linalg.norm(points - centre, axis=1).max())
    flat = _spread_directions(points - centre)
    spread, wanted = (points - centre) @ flat.T / scale, flat @ (place - centre) / scale
    inside = _nearest_in_hull(spread, wanted)
    nearest = inside @ flat * scale + centre
    outside_m = float(np.linalg.norm(place - nearest))
    return PlaceWeights(_linear_weights(spread, inside), _smooth_weights(spread, inside), outside_m)


def _spread_directions(offsets: FloatArray) -> FloatArray:
    """(dimensions, 3): principal directions in which the points spread, as many as keep them distinct."""
    _, spreads, directions = np.linalg.svd(offsets, full_matrices=False)
    rank = int((spreads > FLAT * spreads[0]).sum())
    full = int((spreads > 1e-9 * spreads[0]).sum())
    whole = _smallest_distance(offsets)
    while rank < full and _smallest_distance(offsets @ directions[:rank].T) < 0.5 * whole:
        rank += 1
    return np.asarray(directions[:rank])


def _smallest_distance(points: FloatArray) -> float:
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    return float(apart[np.triu_indices(len(points), 1)].min())


def _nearest_in_hull(points: FloatArray, place: FloatArray) -> FloatArray:
    system = np.vstack([points.T, np.full(len(points), SUM_TO_ONE)])
    weights, _ = nnls(system, np.append(place, SUM_TO_ONE))
    return np.asarray(weights @ points / weights.sum())


def _linear_weights(points: FloatArray, place: FloatArray) -> FloatArray:
    count, dimensions = points.shape
    if dimensions == 1:
        order = np.argsort(points[:, 0])
        along = points[order, 0]
        shares = np.array([np.interp(place[0], along, each) for each in np.eye(count)[:, order]])
        shares[shares < ROUNDING] = 0.0
        return np.asarray(shares / shares.sum())
    mesh = Delaunay(points)
    simplex = int(mesh.find_simplex(place, tol=1e-9))
    if simplex < 0:
        # On the hull to rounding: a step of a millionth towards the middle is inside.
        place = place + 1e-6 * (points.mean(axis=0) - place)
        simplex = int(mesh.find_simplex(place, tol=1e-6))
    transform = mesh.transform[simplex]
    first = np.clip(transform[:dimensions] @ (place - transform[dimensions]), 0.0, 1.0)
    corners = np.append(first, max(0.0, 1.0 - first.sum()))
    corners[corners < ROUNDING] = 0.0
    weights = np.zeros(count)
    weights[mesh.simplices[simplex]] = corners / corners.sum()
    return weights


def _smooth_weights(points: FloatArray, place: FloatArray) -> FloatArray:
    """Multiquadric radial basis functions with a linear part, so wide that they are nearly parabolas between three
    points: a cubic spline's curvature vanishes at the outer ones, where a device's need not."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    nearest = np.median(np.partition(apart, 1, axis=1)[:, 1])
    cardinal = RBFInterpolator(points, np.eye(len(points)), kernel="multiquadric", epsilon=BEND / nearest, degree=1)
    return np.asarray(cardinal(place[None])[0])
