"""Comparison of discovered laws with concealed ones: `law_outcome` (a single case), `law_score` (a bank)."""
