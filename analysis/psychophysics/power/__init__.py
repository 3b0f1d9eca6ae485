"""Whole studies simulated without device, session or file, and what each analysis makes of them.

Begin at `simulated_study.py`.
"""
