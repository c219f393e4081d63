"""Training of the component classifier's network: penalised cross-entropy by L-BFGS, gradients by back-propagation."""

from itertools import pairwise

import numpy as np
from scipy.optimize import minimize

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.slam.classify import Network


def train_network(
    features: Floats, keep: Booleans, weight: Floats, hidden: int, penalty: float, iterations: int,
    *, rng: np.random.Generator
) -> Network:  # fmt: skip
    """Fit a network to examples by least weighted cross-entropy plus `penalty` times half the squared weights.

    Biases are not penalised.

    `features` (N, F), `keep` (N,), `weight` (N,) of the examples (scaled to mean 1). Starts from Glorot's uniform
    distribution; the result depends on `rng` through that alone.
    """
    mean, scale = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-6)
    inputs = (features - mean) / scale
    sizes = [features.shape[1], hidden, hidden, 1]
    shapes: list[tuple[int, ...]] = [s for a, b in pairwise(sizes) for s in ((a, b), (b,))]
    start = []
    for shape in shapes:
        reach = np.sqrt(6.0 / sum(shape)) if len(shape) == 2 else 0.0
        start.append(rng.uniform(-reach, reach, shape).ravel())
    target, share = keep.astype(np.float64), weight / weight.sum()

    def cost(flat: Floats) -> tuple[float, Floats]:
        return loss_and_slope(flat, shapes, inputs, target, share, penalty)

    found = minimize(cost, np.concatenate(start), jac=True, method="L-BFGS-B",
                     options={"maxiter": iterations, "maxcor": 20, "maxfun": 10 * iterations})  # fmt: skip
    arrays = _unpack(found.x, shapes)
    return Network(mean, scale, tuple(arrays[0::2]), tuple(arrays[1::2]))


def loss_and_slope(
    flat: Floats, shapes: list[tuple[int, ...]], inputs: Floats, target: Floats, share: Floats, penalty: float
) -> tuple[float, Floats]:
    """Penalised cross-entropy of the classifier's network with weights `flat` (P,), and its gradient (P,)."""
    arrays = _unpack(flat, shapes)
    values = [inputs]
    for layer in range(0, len(arrays), 2):
        value = values[-1] @ arrays[layer] + arrays[layer + 1]
        values.append(np.tanh(value) if layer < len(arrays) - 2 else value)
    odds = values[-1][:, 0]
    loss = float(share @ (np.logaddexp(0.0, odds) - target * odds))
    back = (share * (0.5 * (1.0 + np.tanh(0.5 * odds)) - target))[:, None]
    slopes: list[Floats] = []
    for layer in range(len(arrays) - 2, -1, -2):
        slopes = [values[layer // 2].T @ back + penalty * arrays[layer], back.sum(axis=0), *slopes]
        back = (back @ arrays[layer].T) * (1.0 - values[layer // 2] ** 2)
    loss += 0.5 * penalty * float(sum(np.sum(matrix**2) for matrix in arrays[0::2]))
    return loss, np.concatenate([slope.ravel() for slope in slopes])


def _unpack(flat: Floats, shapes: list[tuple[int, ...]]) -> list[Floats]:
    """Weight matrices and biases of all layers from one vector."""
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    return [part.reshape(shape) for part, shape in zip(np.split(flat, ends[:-1]), shapes, strict=True)]
