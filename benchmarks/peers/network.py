"""A small convolutional network of averages, as anyone would write it in torch: a peer of the models of sigdb.

It takes the columns ``tsa[i]`` in their order and names the damaged tooth. Convolutions wrap around the revolution, and
every training average is turned by teeth at random, with its label.
"""

from typing import Self

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, ClassifierMixin
from torch import nn

_STRIDE = 4
"""Samples of a step of the first convolution."""


class Network(ClassifierMixin, BaseEstimator):
    """Circular convolutions along the average, then along the teeth; scores of each tooth and of none.

    Parameters
    ----------
    epochs, batch, rate, channels, seed
        Passes over the rows, rows of a step, learning rate of Adam, channels, and seed.
    """

    def __init__(
        self, epochs: int = 5, batch: int = 128, rate: float = 2e-3, channels: int = 32, seed: int = 0
    ) -> None:
        self.epochs = epochs
        self.batch = batch
        self.rate = rate
        self.channels = channels
        self.seed = seed

    def fit(self, X: pd.DataFrame, y: NDArray[np.int64]) -> Self:
        """Train on averages (rows, n) and first damaged teeth, 0 for none."""
        torch.manual_seed(self.seed)
        torch.set_num_threads(1)
        generator = np.random.default_rng(self.seed)
        x, tooth = np.asarray(X, np.float32), np.asarray(y, int)
        self.classes_ = np.arange(tooth.max() + 1)
        self._mean, self._scale = x.mean(), x.std()
        teeth, samples = int(tooth.max()), x.shape[1] // int(tooth.max())
        place = np.arange(x.shape[1])
        self._network = _layers(self.channels, samples)
        optimiser = torch.optim.Adam(self._network.parameters(), lr=self.rate)
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimiser, 5 * self.rate, total_steps=self.epochs * -(-len(x) // self.batch)
        )
        for _ in range(self.epochs):
            order = generator.permutation(len(x))
            for some in np.array_split(order, -(-len(x) // self.batch)):
                turns = generator.integers(0, teeth, len(some))
                signals = x[some[:, None], (place - samples * turns[:, None]) % x.shape[1]]
                turned = np.where(tooth[some] > 0, (tooth[some] - 1 + turns) % teeth + 1, 0)
                loss = nn.functional.cross_entropy(self._scores(signals), torch.from_numpy(turned))
                optimiser.zero_grad()
                loss.backward()
                optimiser.step()
                schedule.step()
        return self

    def predict_proba(self, X: pd.DataFrame) -> NDArray[np.float64]:
        """Return the probabilities of none and of each tooth, (rows, teeth + 1)."""
        with torch.no_grad():
            parts = [self._scores(part) for part in np.array_split(np.asarray(X, np.float32), -(-len(X) // 1024))]
            return torch.softmax(torch.cat(parts), dim=1).double().numpy()

    def predict(self, X: pd.DataFrame) -> NDArray[np.int64]:
        """Return the most probable answers."""
        return self.classes_[self.predict_proba(X).argmax(axis=1)]

    def _scores(self, signals: NDArray[np.float32]) -> torch.Tensor:
        """Return the scores of none, 0, and of each tooth relative to it."""
        x = torch.from_numpy((signals - self._mean) / self._scale)[:, None]
        teeth = self._network(x)[:, 0]
        return torch.cat([torch.zeros(len(teeth), 1), teeth], dim=1)


def _layers(channels: int, samples: int) -> nn.Sequential:
    """Return layers from an average (rows, 1, n) to a score of each tooth (rows, 1, teeth)."""

    def convolution(inputs: int, outputs: int, width: int, stride: int = 1) -> list[nn.Module]:
        return [
            nn.Conv1d(inputs, outputs, width, stride, padding=width // 2, padding_mode="circular"),
            nn.BatchNorm1d(outputs),
            nn.ReLU(),
        ]

    return nn.Sequential(
        *convolution(1, channels, 15, _STRIDE),
        *convolution(channels, channels, 9),
        nn.Conv1d(channels, 2 * channels, samples // _STRIDE, samples // _STRIDE),
        nn.ReLU(),
        *convolution(2 * channels, 2 * channels, 5),
        *convolution(2 * channels, 2 * channels, 5),
        nn.Conv1d(2 * channels, 1, 1),
    )
