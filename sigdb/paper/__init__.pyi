from .results import paper_claims as paper_claims
from .signals import check_subject as check_subject
