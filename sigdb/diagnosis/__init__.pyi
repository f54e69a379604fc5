from .answers import power_sentence as power_sentence
from .change.finding import Finding as Finding
from .change.finding import HealthyLaw as HealthyLaw
from .change.level import LevelChange as LevelChange
from .change.location import Location as Location
from .change.power import Power as Power
from .diagnose_recording import diagnose as diagnose
from .diagnosis import Diagnosis as Diagnosis
