"""Power analysis: studies simulated without device, session or file, and the result of each analysis.

Begin at `simulated_study.py`.
"""
