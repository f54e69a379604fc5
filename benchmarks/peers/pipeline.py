"""A pipeline of scikit-learn on pooled features, as in the guide: a peer of the models of sigdb."""

from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.impute import SimpleImputer
from sklearn.pipeline import Pipeline


class PooledPipeline(Pipeline):
    """Shrinkage discriminant analysis of all input columns of ``features``: a class for each tooth and one for none."""

    def __init__(self) -> None:
        steps = [("impute", SimpleImputer()), ("lda", LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"))]
        super().__init__(steps)
