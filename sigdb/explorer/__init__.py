"""The explorer: a page in the browser on which damage moves, a database is looked through and recordings are read."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
