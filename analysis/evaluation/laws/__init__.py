"""How found laws compare with concealed ones: `law_outcome` (one case), `law_score` (a bank)."""
