"""How we learn: MAP, Laplace draws, emcee, NUTS, identifiability, the posterior."""
