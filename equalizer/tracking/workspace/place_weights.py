"""Interpolation weights of scattered points at a place between them: for models identified at points of the workspace.

Two sets of weights are computed: barycentric coordinates on the Delaunay triangulation (piecewise linear, never
negative), used by `blended_inverse` for forces and by `modal_interpolation` for smooth remainders, and cardinal
functions of multiquadric radial basis functions (smooth), used by `modal_interpolation` for the parameters of
resonances. A place outside the convex hull of the points is replaced by the nearest place inside.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.optimize import nnls
from scipy.spatial import Delaunay

from equalizer.signals.signal import FloatArray
from equalizer.tracking.workspace.workspace_models import Place

MIN_SPREAD_RATIO = 0.05
"""Spread of the points in a principal direction, relative to the largest (ratio of singular values), up to which that
direction is usually ignored: otherwise the triangulation of hand-placed points, which lie on a line or surface only
nearly, would have slivers that join distant points. Chosen."""
HULL_TOLERANCE_M = 1e-3
"""Distance to the points' convex hull, in m, up to which a place counts as inside. Chosen."""
SUM_EQUATION_FACTOR = 1e6
"""Factor of the equation sum(w) = 1 in the least-squares search for the nearest point of the hull; the other equations
are distances of order 1. Chosen: the sum is then 1 within rounding."""

MULTIQUADRIC_SHAPE = 0.35
"""Shape parameter epsilon of the multiquadrics sqrt(1 + (epsilon r)²), times the median distance between nearest
neighbours: the smaller, the closer they are to parabolas. Chosen."""
NEGLIGIBLE_WEIGHT = 1e-6
"""Linear weights below this are set to zero, because forces are computed for each point with a weight above zero.
Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaceWeights:
    """Interpolation weights at a place, of points where models were identified; result of `compute_place_weights`."""

    linear: FloatArray
    """(points,): none negative, sum 1; linear between neighbours, continuous, exact at the points."""
    smooth: FloatArray
    """(points,): sum 1, exact at the points, with a continuous slope; some may be negative. For quantities that vary
    smoothly with the place, such as a frequency."""
    outside_m: float
    """Distance of the place from the points' convex hull in m; the weights are those of the nearest place inside."""

    @property
    def remark(self) -> str | None:
        """Sentence for the user about a place more than `HULL_TOLERANCE_M` outside the hull; else None."""
        if self.outside_m <= HULL_TOLERANCE_M:
            return None
        return (
            f"the place is {1e3 * self.outside_m:.1f} mm outside the points where models were identified: "
            "the nearest place between them was used"
        )


def compute_place_weights(points_m: FloatArray, place_m: Place | FloatArray) -> PlaceWeights:
    """Compute the weights of points_m (points, 3), all different, at place_m (3,), both in m. Points nearly on a line
    or in a plane are interpolated in that line or plane. A single point has the weight 1 at every place.
    Inverse-distance weights are not used, because interpolation with them has zero slope at every point."""
    point_positions_m = np.asarray(points_m, dtype=np.float64)
    place_position_m = np.asarray(place_m, dtype=np.float64)
    if len(point_positions_m) == 1:
        single_weight = np.ones(1)
        return PlaceWeights(
            single_weight, single_weight, float(np.linalg.norm(place_position_m - point_positions_m[0]))
        )
    centre_m = point_positions_m.mean(axis=0)
    radius_m = float(np.linalg.norm(point_positions_m - centre_m, axis=1).max())
    principal_directions = _find_principal_directions(point_positions_m - centre_m)
    projected_points, projected_place = (
        (point_positions_m - centre_m) @ principal_directions.T / radius_m,
        principal_directions @ (place_position_m - centre_m) / radius_m,
    )
    nearest_place = _find_nearest_in_hull(projected_points, projected_place)
    nearest_place_m = nearest_place @ principal_directions * radius_m + centre_m
    outside_m = float(np.linalg.norm(place_position_m - nearest_place_m))
    return PlaceWeights(
        _compute_linear_weights(projected_points, nearest_place),
        _compute_smooth_weights(projected_points, nearest_place),
        outside_m,
    )


def _find_principal_directions(offsets_m: FloatArray) -> FloatArray:
    """(dimensions, 3): principal directions of offsets_m (points, 3) by singular value decomposition. Directions
    with little spread (`MIN_SPREAD_RATIO`) are left out, unless without them the smallest distance between two points
    would fall below half; directions with a spread of zero, within rounding (1e-9), always are."""
    _, spreads, directions = np.linalg.svd(offsets_m, full_matrices=False)
    rank = int((spreads > MIN_SPREAD_RATIO * spreads[0]).sum())
    full_rank = int((spreads > 1e-9 * spreads[0]).sum())
    full_rank_distance_m = _compute_smallest_distance(offsets_m)
    while rank < full_rank and _compute_smallest_distance(offsets_m @ directions[:rank].T) < 0.5 * full_rank_distance_m:
        rank += 1
    return np.asarray(directions[:rank])


def _compute_smallest_distance(points: FloatArray) -> float:
    """Smallest distance between two of the points (points, dimensions), at least two."""
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    return float(distances[np.triu_indices(len(points), 1)].min())


def _find_nearest_in_hull(points: FloatArray, place: FloatArray) -> FloatArray:
    """(dimensions,): the place if it is inside, else the nearest point of the convex hull: least |sum w_i p_i - place|,
    w_i >= 0 and sum w_i = 1, by non-negative least squares (scipy's `nnls`). Coordinates are scaled to order 1."""
    equation_matrix = np.vstack([points.T, np.full(len(points), SUM_EQUATION_FACTOR)])
    weights, _ = nnls(equation_matrix, np.append(place, SUM_EQUATION_FACTOR))
    return np.asarray(weights @ points / weights.sum())


def _compute_linear_weights(points: FloatArray, place: FloatArray) -> FloatArray:
    """(points,): barycentric coordinates of the place in its simplex of the Delaunay triangulation; between the two
    neighbours in one dimension."""
    point_count, dimension_count = points.shape
    if dimension_count == 1:
        sorting_order = np.argsort(points[:, 0])
        sorted_positions = points[sorting_order, 0]
        weights = np.array(
            [
                np.interp(place[0], sorted_positions, unit_values)
                for unit_values in np.eye(point_count)[:, sorting_order]
            ]
        )
        weights[weights < NEGLIGIBLE_WEIGHT] = 0.0
        return np.asarray(weights / weights.sum())
    triangulation = Delaunay(points)
    simplex_index = int(triangulation.find_simplex(place, tol=1e-9))
    if simplex_index < 0:
        # The place is outside the hull by rounding: a step of a millionth towards the centre is inside.
        place = place + 1e-6 * (points.mean(axis=0) - place)
        simplex_index = int(triangulation.find_simplex(place, tol=1e-6))
    affine_transform = triangulation.transform[simplex_index]
    first_coordinates = np.clip(
        affine_transform[:dimension_count] @ (place - affine_transform[dimension_count]), 0.0, 1.0
    )
    barycentric = np.append(first_coordinates, max(0.0, 1.0 - first_coordinates.sum()))
    barycentric[barycentric < NEGLIGIBLE_WEIGHT] = 0.0
    all_weights = np.zeros(point_count)
    all_weights[triangulation.simplices[simplex_index]] = barycentric / barycentric.sum()
    return all_weights


def _compute_smooth_weights(points: FloatArray, place: FloatArray) -> FloatArray:
    """(points,): cardinal functions of multiquadric radial basis functions with a linear part, so wide that they are
    nearly parabolas through three points. A natural cubic spline is not used: its curvature vanishes at the outer
    points, where that of a device's parameters need not."""
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    neighbour_distance = np.median(np.partition(distances, 1, axis=1)[:, 1])
    cardinal_functions = RBFInterpolator(
        points, np.eye(len(points)), kernel="multiquadric", epsilon=MULTIQUADRIC_SHAPE / neighbour_distance, degree=1
    )
    return np.asarray(cardinal_functions(place[None])[0])
