"""Size of a study before its first participant: power by simulated studies (`simulate_power`).

The order of runs of the next participant is planned elsewhere, in `workflows/views/plan_study.py`.
"""
