"""The claims of the paper that sigdb started from, evaluated on simulated signals."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "PaperClaims",
    "identified_rigs",
    "paper_claims",
]
