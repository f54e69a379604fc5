"""Templates as hypotheses: likelihoods, posteriors, scores."""
