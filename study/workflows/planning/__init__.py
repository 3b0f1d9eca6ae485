"""Size of a study before its first participant: power by simulated studies.

`simulate_power` is the only module. Used by `study.cli.power` (`hapteq power`). The order of runs of the next
participant is planned in `study.workflows.views.plan_study`.
"""
