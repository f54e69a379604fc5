from .public_set import PublicSet as PublicSet
from .public_set import load_public_set as load_public_set
from .public_set import public_set_names as public_set_names
from .set_folder import FolderCheck as FolderCheck
from .set_folder import check_folder as check_folder
from .set_folder import ingest_set as ingest_set
from .set_results import SetResults as SetResults
from .set_results import evaluate_set as evaluate_set
