"""Physical parameters of the simulated omega.3; see docs/simulated_omega3.md.

No link length, inertia, friction or cable stiffness of the omega.3 is public. The numbers below describe a device of
its size. The docstrings state their source, or the feature of the published measurements for which they were chosen.
`packing` converts them to the array of the compiled functions.
"""

from dataclasses import dataclass, field

Vector = tuple[float, float, float]
"""Three numbers for x, y, z, or for the three legs."""

GRAVITY_MPS2 = 9.81
"""Acceleration of gravity, rounded, and unit g of the accelerometer's data (m/s²)."""


@dataclass(frozen=True, slots=True)
class Linkage:
    """Arms of the Falcon (libnifalcon, FalconGeometry.h) times 1.6, which gives about the omega.3's workspace of
    160 mm x 110 mm (its data sheet). The hinge offsets of the Falcon's parallelograms (11 mm) are left out."""

    upper_arm_m: float = 1.6 * 0.060
    forearm_m: float = 1.6 * 0.1025
    radius_m: float = 0.055
    """Base radius less platform radius. The Falcon's value times 1.6 would be 0.041 m, but without its hinge offsets
    the legs would then fold (singular) 60 mm behind the isotropic point. At 0.055 m they stay far from it within the
    stops."""
    azimuths_deg: Vector = (90.0, 210.0, 330.0)
    """From y towards z. The first leg is upright, as on the omega.3, so that the x-z plane is a mirror plane."""
    depth_m: float | None = None
    """Distance of the origin in front of the base's plane; None: the origin is the isotropic point (`packing`)."""


@dataclass(frozen=True, slots=True)
class Masses:
    """Lumped model (A. Codourey, Int. J. Robotics Research 17 (1998), 1325): two thirds of a forearm at its elbow, one
    third at the platform."""

    handle_kg: float = 0.128
    """Platform and handle: with the forearms' share the 0.148 kg of CHAI3D-based configurations of the omega.3."""
    forearm_kg: float = 0.020
    """Mass of a forearm."""
    upper_arm_kg_m2: float = 1.5e-4
    """Aluminium arm of 35 g with its hinge, about its pivot. Counterweighted: a moving base does not turn it."""
    drive_kg_m2: float = 8.2e-4
    """Rotor of 30 g cm² (DC motors of 30 mm: 10 to 35) times the square of the capstan's ratio 16, and the drum."""


@dataclass(frozen=True, slots=True)
class Drives:
    """The three drives, equal but for the cables: amplifier, motor, capstan and cable; angles and torques about the
    arm's pivot."""

    amplifier_hz: float = 600.0
    """Corner frequency of the current loop, a first-order low pass: common for such amplifiers."""
    friction_n_m: float = 1.1e-2
    """Coulomb level (brushes, bearings, cable): 0.20 N at the handle along z, about 2 % of full force."""
    presliding_rad: float = 1.6e-4
    """Largest deflection of Dahl's bristle: 18 um at the handle, the order of cables and ball bearings."""
    damping_n_m_s: float = 8.3e-2
    """Back-EMF and grease: 10 N s/m at the handle, so that friction and damping dominate below 10 Hz."""
    cable_n_m_per_rad: Vector = (158.0, 140.0, 179.0)
    """17-22 N/mm at the handle, order of the data sheet's 14.5 N/mm closed loop; the first structural modes then are
    at 80 Hz and above. Unequal, as cables tensioned by hand: this couples the axes at these modes."""
    cable_damping_ratio: float = 0.03
    """Damping ratio of the inertia of a motor on its cable, with the arm at rest. Assumed."""
    counts_per_turn: float = 64000.0
    """1000 lines, four edges, ratio 16: 8.8 um of motion along one leg's forearm; the data sheet says below 10 um."""


@dataclass(frozen=True, slots=True)
class Mount:
    """Base on its feet and table: two rocking modes, whose motion at the handle has oblique directions. Assumed: chosen
    to give the coupling published at 15, 25 and 35 Hz."""

    frequencies_hz: tuple[float, float] = (20.0, 26.6)
    damping_ratios: tuple[float, float] = (0.06, 0.06)
    masses_kg: tuple[float, float] = (2.7, 1.1)
    """Modal masses at the handle: a base of about 5 kg that rocks below the height of the handle."""
    directions: tuple[Vector, Vector] = ((0.88, 0.42, 0.23), (0.18, 0.15, 0.97))


@dataclass(frozen=True, slots=True)
class HandleModes:
    """Oscillators on the platform. The first is the lumped mass of cable loom, sensor lead and cover on an oblique soft
    spring: the coupled resonance near 11 Hz. The others are bending and twisting of handle, platform and forearms,
    along oblique directions. Assumed: published are only the 11 Hz and that there are large modes from 80 Hz on."""

    frequencies_hz: tuple[float, ...] = (10.9, 134.0, 188.0, 251.0, 322.0, 391.0)
    damping_ratios: tuple[float, ...] = (0.028, 0.03, 0.025, 0.025, 0.022, 0.022)
    masses_kg: tuple[float, ...] = (0.019, 0.008, 0.008, 0.007, 0.006, 0.006)
    gains: tuple[float, ...] = (0.0, 0.3, 0.35, 0.4, 0.5, 0.6)
    """Share of the displacement of a mode at the accelerometer."""
    directions: tuple[Vector, ...] = (
        (0.85, 0.53, -0.02),
        (0.3, 0.8, 0.5),
        (0.8, -0.4, 0.5),
        (0.5, 0.5, -0.7),
        (-0.6, 0.6, 0.5),
        (0.4, -0.5, 0.8),
    )


@dataclass(frozen=True, slots=True)
class Hand:
    """A light three-finger grip on the handle, resting where the handle starts. Fingers and wrist: order of pen-hold
    and pinch measurements (Hasser and Cutkosky 2002; Israr, Choi and Tan 2006), well below a whole arm's
    0.55 kg, 6.5 N s/m, 135 N/m (Sci. Rep. srep18004)."""

    mass_kg: Vector = (0.08, 0.10, 0.09)
    damping_n_s_per_m: Vector = (4.5, 3.4, 3.8)
    stiffness_n_per_m: Vector = (150.0, 100.0, 120.0)


@dataclass(frozen=True, slots=True)
class Accelerometer:
    """ADXL335 (Analog Devices, data sheet Rev. B), at 3 V, with 10 nF per axis (first-order low pass of 500 Hz)."""

    noise_g_per_rthz: Vector = (150e-6, 150e-6, 300e-6)
    bandwidth_hz: float = 500.0
    range_g: float = 3.0
    turns_deg: Vector = (0.7, -0.8, 0.9)
    """Mounting error about x, y, z: package tolerance is 1 degree."""
    cross_axis: Vector = (0.010, -0.008, 0.009)
    """Cross-axis sensitivity yz, zx, xy: the data sheet's 1 %."""


@dataclass(frozen=True, slots=True)
class Stops:
    """End stop, a spring and damper beyond a sphere: no force within the radius that CHAI3D states as usable. Spring
    and damper are chosen: 12 N, the largest force, reach 87 mm at most."""

    radius_m: float = 0.075
    stiffness_n_per_m: float = 2500.0
    damping_n_s_per_m: float = 15.0


@dataclass(frozen=True, slots=True)
class Omega3Parameters:
    """All parameters of the simulated omega.3, with the hand that holds it and its accelerometer."""

    linkage: Linkage = field(default_factory=Linkage)
    masses: Masses = field(default_factory=Masses)
    drives: Drives = field(default_factory=Drives)
    mount: Mount = field(default_factory=Mount)
    handle_modes: HandleModes = field(default_factory=HandleModes)
    hand: Hand = field(default_factory=Hand)
    accelerometer: Accelerometer = field(default_factory=Accelerometer)
    stops: Stops = field(default_factory=Stops)
