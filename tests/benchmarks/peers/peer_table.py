"""Who is compared: peers live in environments of their own and are never dependencies."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Method:
    """One way to use a peer."""

    label: str
    options: dict
    seeds: int = 5
    """At most; fewer for the slow ones."""
    heavy: bool = False
    """Left out with --quick."""
    assisted: bool = False
    """A part of it is ours: not what a user of the peer gets."""


@dataclass(frozen=True)
class Peer:
    name: str
    """As on the package index; its runner is run_<name>.py."""
    requirements: tuple[str, ...]
    """The peer first, then what decides its numbers; each pinned."""
    licence: str
    methods: tuple[Method, ...] = field(default_factory=tuple)

    @property
    def runner(self) -> str:
        return f"run_{self.name.replace('-', '_')}.py"


PEERS = (
    Peer(
        "ctrlsys",
        ("ctrlsys==1.1.1", "numpy==2.4.6"),
        "BSD-3-Clause",
        (
            Method("MOESP, 250 Hz", {"factor": 4, "rows": 30, "own": True}),
            Method("MOESP, 500 Hz, 60 rows", {"factor": 2, "rows": 60, "own": True}),
            Method("MOESP A, C + our B, D, 125 Hz", {"factor": 8, "rows": 30, "own": False}, assisted=True),
            Method("MOESP A, C + our B, D, 250 Hz", {"factor": 4, "rows": 30, "own": False}, assisted=True),
            Method("MOESP A, C + our B, D, 500 Hz, 60 rows", {"factor": 2, "rows": 60, "own": False}, assisted=True),
            Method("MOESP A, C + our B, D, 1 kHz, 60 rows", {"factor": 1, "rows": 60, "own": False}, assisted=True),
        ),
    ),
    Peer(
        "nfoursid",
        ("nfoursid==1.0.2", "numpy==2.4.6", "pandas==3.1.1"),
        "MIT",
        (Method("N4SID, 125 Hz, 120 of 180 s", {"factor": 8, "rows": 30}, seeds=1, heavy=True),),
    ),
    Peer(
        "sippy_unipi",
        ("sippy_unipi==1.0.1", "numpy==2.4.6", "scipy==1.17.1", "control==0.10.2"),
        "LGPL-3.0-or-later",
        (
            Method("N4SID, 125 Hz", {"factor": 8, "rows": 30, "method": "N4SID", "stability": False}, seeds=2),
            Method("N4SID, 250 Hz", {"factor": 4, "rows": 30, "method": "N4SID", "stability": False}),
            Method("CVA, 250 Hz", {"factor": 4, "rows": 30, "method": "CVA", "stability": False}, seeds=2, heavy=True),
            Method(
                "N4SID, made stable, 125 Hz", {"factor": 8, "rows": 30, "method": "N4SID", "stability": True}, seeds=2
            ),
        ),
    ),
    Peer(
        "jax-sysid",
        ("jax-sysid==1.1.0", "jax==0.4.31", "jaxlib==0.4.31", "numpy==2.2.6", "scipy==1.14.1"),
        "Apache-2.0",
        (Method("300 Adam + 300 L-BFGS, 125 Hz", {"factor": 8, "adam": 300, "lbfgs": 300}, seeds=1, heavy=True),),
    ),
    Peer(
        "scikit-rf",
        ("scikit-rf==2.2.0", "numpy==2.4.6", "scipy==1.17.1"),
        "BSD-3-Clause",
        (
            Method("vector fitting, 27 states", {"real": 1, "pairs": 4}),
            Method("vector fitting, 45 states", {"real": 1, "pairs": 7}, seeds=2, heavy=True),
        ),
    ),
    Peer(
        "pymor",
        ("pymor==2026.1.0", "numpy==2.4.6", "scipy==1.17.1"),
        "BSD-2-Clause",
        (Method("Loewner, 225 lines", {"lines": 225}),),
    ),
)
