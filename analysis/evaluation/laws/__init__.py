"""Comparison of discovered laws with concealed ones.

`law_error` (error of a law along a simulated motion) -> `law_outcome` (a single case) -> `law_score` (a bank of cases).
Used by `study.evaluation.bank.laws`. Begin at `law_outcome.py`.
"""
