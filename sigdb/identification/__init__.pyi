from .identification import Identification as Identification
from .identification import Member as Member
from .identification_text import identification_markdown as identification_markdown
from .identification_text import write_identification as write_identification
from .identify_rigs import identify as identify
from .targets import Targets as Targets
from .targets import load_targets as load_targets
