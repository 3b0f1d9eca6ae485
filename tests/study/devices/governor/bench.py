"""A governor on a simulated mass."""

from study.devices.device import Health
from study.devices.drive.runner import CompiledRunner
from study.devices.governor.governor import Governor


class Bench:
    """A governor on a mass, with no checks before it: what reaches the tick here may be anything."""

    def __init__(self, rigs, settings=None) -> None:
        self.rigs = rigs
        self.rig = rigs.compiled_rig()
        self.governor = Governor(self.rig.info, settings or rigs.SETTINGS)
        self.runner = CompiledRunner(self.rig, self.governor, 50)

    def hold(self, stimulus, ticks: int):
        self.governor.begin_hold(stimulus)
        return self.go_on(ticks)

    def go_on(self, ticks: int):
        """With signs of life. All forces so far."""
        for _ in range(0, ticks, 10):
            if self.governor.moving:
                self.governor.restart_watchdog()
                self.runner.run(10)
        return self.forces()

    def lean(self, x: float, y: float, z: float) -> None:
        self.rig.state[self.rigs.LEAN : self.rigs.LEAN + 3] = x, y, z

    def forces(self):
        return self.rigs.written(self.rig)

    def health(self) -> Health:
        return self.governor.collect_health()

    def gained(self):
        return self.governor.copy_rows()[:, 3:6]
