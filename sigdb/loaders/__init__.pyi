from .batch_dataset import BatchDataset as BatchDataset
from .row_dataset import RowDataset as RowDataset
