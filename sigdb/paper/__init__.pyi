from .identified import identified_rigs as identified_rigs
from .results import ClaimValue as ClaimValue
from .results import EvaluatedClaim as EvaluatedClaim
from .results import PaperClaims as PaperClaims
from .results import VariedClaims as VariedClaims
from .results import paper_claims as paper_claims
from .signals import check_subject as check_subject
