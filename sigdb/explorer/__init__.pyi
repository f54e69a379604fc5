from .live import LiveRig as LiveRig
from .live import Shown as Shown
from .serve import DEFAULT_RIG as DEFAULT_RIG
from .serve import serve_explorer as serve_explorer
from .static_page import write_static as write_static
from .view import View as View
