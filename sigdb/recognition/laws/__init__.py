"""Laws of averages: normal ones of each template and turn, and their mixtures over nuisances."""
