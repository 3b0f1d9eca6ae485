"""Laws that have no name: which formula of the motion and the commands a model lacks.

In this order: `grammar` lists the terms, `whitened` turns a fit's residuals into what a force along one axis could have
made of them, `screen` and `beam` rank terms and sums by held-out error, with their free numbers fitted (`sums`);
`discover` fits the best by output error, one law after another, and `snap` writes plain exponents; `proof` says what
must hold before a law may be said, and `join` puts it in the place of names that it beats.
"""
