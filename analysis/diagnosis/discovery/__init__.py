"""Symbolic regression: which formula of the motion and the commands a model lacks, where no catalogue effect fits.

Theory of operation. A law is a sum of up to a few terms, F = sum of w_j phi_j(q, q', u; a_j): shapes phi_j of a grammar
with linear factors w_j and nonlinear parameters a_j (exponents, widths, time constants).

1. `grammar`, `view_terms` and `periodic_terms` list the terms, with grids of starting values for a_j; `evaluate_shape`
   computes a term along the samples.
2. `matched_filter` filters the residuals r of a fit so that they show a force along an axis, or an error of a reading,
   that could have caused them: with H the model's transfer function from that force, in units of the noise,
   b = H* r / |H|. Noise stays white, and a column of terms costs two Fourier transforms instead of a simulation.
3. `screen_terms` regresses b on each term together with the columns of the model's own parameters. The error of a block
   is that of weights fitted to all other blocks (cross-validation). `beam` extends the best terms to sums,
   ranked by the Bayesian information criterion (squared error plus log n for each parameter); `fit_sum` fits the
   nonlinear parameters. A time-shuffled b gives the gain that chance has: the negative control.
4. `discover` fits the best sums (`convert_sum` makes laws of them) by output error (`fit_laws`), adds the best sum, and
   repeats; `antisymmetric_pairs` joins forces of two axes on each other; `snap_exponents` replaces fitted exponents by
   whole or half numbers where the error allows.
5. `validation` tests the conditions for naming a law: held-out stretches of another kind confirm it, its parameters
   agree between stretches, the time-shuffled force yields no law, and no law of other variables fits as well.
   `add_laws` replaces effects by a law that fits better.

References: Stone, J. R. Stat. Soc. B 36:111 (1974), cross-validation; Brunton, Proctor and Kutz, PNAS 113:3932 (2016),
sparse regression of dynamics; Schmidt and Lipson, Science 324:81 (2009). Begin at `discover.py`.
"""
