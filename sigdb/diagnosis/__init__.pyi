from .comparison import Comparison as Comparison
from .diagnose_recording import diagnose as diagnose
from .diagnosis import Diagnosis as Diagnosis
