from .history import GearHistory as GearHistory
from .history import gear_history as gear_history
from .looks import Look as Look
from .monitor_database import monitor as monitor
from .settings import MonitorSettings as MonitorSettings
