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
à 4 degrés de liberté", thesis 925, EPFL 1991. Compiled into `compiled` and `dynamics` (inverse), and `sensors`
(forward).
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import AZIMUTH, FOREARM_LENGTH, PLATFORM_DEPTH, RADIUS_DIFFERENCE, UPPER_ARM_LENGTH


@inlined
def solve_leg(parameters: FloatArray, position: FloatArray, leg: int, angle_gradient: FloatArray) -> float:
    """Compute the joint angle of one leg (0 to 2), rad, with the elbow outwards; fills `angle_gradient` (3,), d angle /
    d position, rad/m. parameters: as in `layout`; position: (3,), m.

    Where the handle is out of reach, which the mechanical stops exclude, the cosine is clipped: the angle is that of an
    upper arm in line with the handle, and the gradient is singular.
    """
    upper_arm, forearm = parameters[UPPER_ARM_LENGTH], parameters[FOREARM_LENGTH]
    cosine, sine = parameters[AZIMUTH + 2 * leg], parameters[AZIMUTH + 2 * leg + 1]
    depth = position[0] + parameters[PLATFORM_DEPTH]
    inward = position[1] * cosine + position[2] * sine - parameters[RADIUS_DIFFERENCE]
    lateral = position[2] * cosine - position[1] * sine
    reach = math.sqrt(inward * inward + depth * depth)
    # Law of cosines for the offset angle between the upper arm and the line from its pivot to the handle, in the leg's
    # plane.
    cos_offset = (reach * reach + lateral * lateral + upper_arm * upper_arm - forearm * forearm) / (
        2.0 * upper_arm * reach
    )
    cos_offset = min(1.0, max(-1.0, cos_offset))
    sin_offset = math.sqrt(1.0 - cos_offset * cos_offset)
    cos_q = (inward * cos_offset + depth * sin_offset) / reach
    sin_q = (depth * cos_offset - inward * sin_offset) / reach
    radial = inward - upper_arm * cos_q
    axial = depth - upper_arm * sin_q
    # (p - e) . (dp - de/dq dq) = 0, from the forearm's constant length; lever = (p - e) . de/dq.
    lever = upper_arm * (axial * cos_q - radial * sin_q)
    angle_gradient[0] = axial / lever
    angle_gradient[1] = (radial * cosine - lateral * sine) / lever
    angle_gradient[2] = (radial * sine + lateral * cosine) / lever
    return math.atan2(sin_q, cos_q)


@inlined
def solve_inverse_kinematics(
    parameters: FloatArray, position: FloatArray, angles: FloatArray, jacobian: FloatArray
) -> None:
    """Fill angles (3,), rad, and jacobian (3, 3), rad/m: joint speeds = jacobian @ handle velocity. position: (3,),
    m."""
    for leg in range(3):
        angles[leg] = solve_leg(parameters, position, leg, jacobian[leg])


@inlined
def solve_forward_kinematics(parameters: FloatArray, angles: FloatArray, position: FloatArray) -> None:
    """Fill position (3,), m: of the two points at the forearm's length from all three elbows, the one farther along x.
    angles: (3,), rad."""
    elbows = np.empty((3, 3))
    for leg in range(3):
        radial = parameters[RADIUS_DIFFERENCE] + parameters[UPPER_ARM_LENGTH] * math.cos(angles[leg])
        elbows[leg, 0] = parameters[UPPER_ARM_LENGTH] * math.sin(angles[leg])
        elbows[leg, 1] = radial * parameters[AZIMUTH + 2 * leg]
        elbows[leg, 2] = radial * parameters[AZIMUTH + 2 * leg + 1]
    first_side, second_side, normal = np.empty(3), np.empty(3), np.empty(3)
    for axis in range(3):
        first_side[axis] = elbows[1, axis] - elbows[0, axis]
        second_side[axis] = elbows[2, axis] - elbows[0, axis]
    _cross(first_side, second_side, normal)
    g11, g12, g22 = _dot(first_side, first_side), _dot(first_side, second_side), _dot(second_side, second_side)
    # Circumcentre of the elbows, from the first one in the basis of two sides. g11, g12, g22: Gram matrix of the sides;
    # squared_area is its determinant, |normal|^2.
    squared_area = g11 * g22 - g12 * g12
    first_share = 0.5 * g22 * (g11 - g12) / squared_area
    second_share = 0.5 * g11 * (g22 - g12) / squared_area
    squared_radius = first_share * first_share * g11 + 2.0 * first_share * second_share * g12 + second_share**2 * g22
    # Distance of the handle from the elbows' plane, in units of the normal.
    height = math.sqrt(max(parameters[FOREARM_LENGTH] ** 2 - squared_radius, 0.0) / squared_area)
    if normal[0] < 0.0:
        height = -height
    for axis in range(3):
        in_plane = first_share * first_side[axis] + second_share * second_side[axis]
        position[axis] = elbows[0, axis] + in_plane + height * normal[axis]
    position[0] -= parameters[PLATFORM_DEPTH]


@inlined
def _dot(a: FloatArray, b: FloatArray) -> float:
    """Compute the scalar product of two vectors (3,)."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@inlined
def _cross(a: FloatArray, b: FloatArray, product: FloatArray) -> None:
    """Fill product (3,) with the vector product a x b."""
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]
