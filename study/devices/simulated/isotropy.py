"""Where the workspace's centre is: the point of the base axis at which the linkage is isotropic."""

import math

from study.devices.simulated.parameters import Linkage


def isotropic_depth_m(linkage: Linkage) -> float:
    """Distance of that point from the base plane.

    On the axis each Jacobian row is parallel to its forearm. Three rows at 120 degrees give J^T J a multiple of the
    identity when the forearm's radial part is sqrt(2) times its axial part.
    """
    radial = linkage.forearm_m * math.sqrt(2 / 3)
    cosine = (radial - linkage.radius_m) / linkage.upper_arm_m
    if not -1 < cosine < 1:
        raise ValueError(f"no isotropic point on the axis: it would need cos q = {cosine:.3f}, between -1 and 1")
    return linkage.forearm_m / math.sqrt(3) + linkage.upper_arm_m * math.sqrt(1 - cosine**2)
