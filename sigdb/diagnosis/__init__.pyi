from .diagnose import diagnose as diagnose
from .diagnosis import Diagnosis as Diagnosis
