"""Inverse and forward kinematics of the delta linkage: handle position to joint angles and back, in closed form.

The x axis points from the base towards the operator, y right, z up. Clavel's delta has three legs, each with an
actuated upper arm at the rim of the base and a parallelogram as forearm to the platform. The platform does not rotate,
so that only the difference of the radii of base and platform matters (`radius`). Let u be the radial direction of a leg
in the y-z plane, q the angle of its upper arm out of the base plane, and p the position of the handle relative to the
base's centre (its coordinates plus `PLATFORM_DEPTH` along x). The elbow e, moved inwards by the platform's radius,
satisfies

    e(q) = (radius + upper_arm cos q) u + upper_arm sin q x,     |p - e(q)| = forearm.

The inverse solves this for q, leg by leg; the forward solution is the intersection of the three spheres of radius
`forearm` about the elbows. All lengths in m, angles in rad. Source: R. Clavel, "Conception d'un robot parallèle rapide
à 4 degrés de liberté", thesis 925, EPFL 1991.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import AZIMUTH, FOREARM, PLATFORM_DEPTH, RADIUS, UPPER_ARM


@inlined
def solve_leg(parameters: FloatArray, position: FloatArray, number: int, row: FloatArray) -> float:
    """Joint angle of one leg, rad, with the elbow outwards; `row` (3,) becomes d angle / d position, rad/m.

    Where the handle is out of reach, which the mechanical stops exclude, the cosine is clipped: the angle is that of an
    upper arm in line with the handle, and the row is singular.
    """
    upper, forearm = parameters[UPPER_ARM], parameters[FOREARM]
    cosine, sine = parameters[AZIMUTH + 2 * number], parameters[AZIMUTH + 2 * number + 1]
    depth = position[0] + parameters[PLATFORM_DEPTH]
    inward = position[1] * cosine + position[2] * sine - parameters[RADIUS]
    lateral = position[2] * cosine - position[1] * sine
    reach = math.sqrt(inward * inward + depth * depth)
    # Law of cosines for the angle between the upper arm and the line from its pivot to the handle, in the leg's plane.
    cos_elbow = (reach * reach + lateral * lateral + upper * upper - forearm * forearm) / (2.0 * upper * reach)
    cos_elbow = min(1.0, max(-1.0, cos_elbow))
    sin_elbow = math.sqrt(1.0 - cos_elbow * cos_elbow)
    cos_q = (inward * cos_elbow + depth * sin_elbow) / reach
    sin_q = (depth * cos_elbow - inward * sin_elbow) / reach
    radial = inward - upper * cos_q
    axial = depth - upper * sin_q
    # (p - e) . (dp - de/dq dq) = 0, from the forearm's constant length; lever = (p - e) . de/dq.
    lever = upper * (axial * cos_q - radial * sin_q)
    row[0] = axial / lever
    row[1] = (radial * cosine - lateral * sine) / lever
    row[2] = (radial * sine + lateral * cosine) / lever
    return math.atan2(sin_q, cos_q)


@inlined
def inverse_kinematics(parameters: FloatArray, position: FloatArray, angles: FloatArray, jacobian: FloatArray) -> None:
    """Fill angles (3,), rad, and jacobian (3, 3), rad/m: joint speeds = jacobian @ handle velocity. position: (3,),
    m."""
    for number in range(3):
        angles[number] = solve_leg(parameters, position, number, jacobian[number])


@inlined
def forward_kinematics(parameters: FloatArray, angles: FloatArray, position: FloatArray) -> None:
    """Fill position (3,), m: of the two points at the forearm's length from all three elbows, the one farther along x.
    angles: (3,), rad."""
    elbows = np.empty((3, 3))
    for number in range(3):
        radial = parameters[RADIUS] + parameters[UPPER_ARM] * math.cos(angles[number])
        elbows[number, 0] = parameters[UPPER_ARM] * math.sin(angles[number])
        elbows[number, 1] = radial * parameters[AZIMUTH + 2 * number]
        elbows[number, 2] = radial * parameters[AZIMUTH + 2 * number + 1]
    first, second, normal = np.empty(3), np.empty(3), np.empty(3)
    for axis in range(3):
        first[axis] = elbows[1, axis] - elbows[0, axis]
        second[axis] = elbows[2, axis] - elbows[0, axis]
    _cross(first, second, normal)
    g11, g12, g22 = _dot(first, first), _dot(first, second), _dot(second, second)
    # Circumcentre of the elbows, from the first one in the basis of two sides; area is |normal|^2.
    area = g11 * g22 - g12 * g12
    along_first = 0.5 * g22 * (g11 - g12) / area
    along_second = 0.5 * g11 * (g22 - g12) / area
    centre = along_first * along_first * g11 + 2.0 * along_first * along_second * g12 + along_second**2 * g22
    # Distance of the handle from the elbows' plane, in units of the normal.
    height = math.sqrt(max(parameters[FOREARM] ** 2 - centre, 0.0) / area)
    if normal[0] < 0.0:
        height = -height
    for axis in range(3):
        in_plane = along_first * first[axis] + along_second * second[axis]
        position[axis] = elbows[0, axis] + in_plane + height * normal[axis]
    position[0] -= parameters[PLATFORM_DEPTH]


@inlined
def _dot(a: FloatArray, b: FloatArray) -> float:
    """Scalar product of two vectors (3,)."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@inlined
def _cross(a: FloatArray, b: FloatArray, product: FloatArray) -> None:
    """Fill out (3,) with the vector product a x b."""
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]
