"""Choice of the engine that weighs the particles: Dr.Jit where the machine has what it needs, else numpy."""

from functools import cache

from rislam_rt.errors import SetupError
from rislam_rt.slam.nested.particles.landmark_cloud import CloudEngine
from rislam_rt.slam.nested.particles.numpy_engine import NumpyEngine


@cache
def pick_engine(name: str) -> CloudEngine:
    """Engine that weighs landmark particles, `auto`, `drjit` or `numpy`; Dr.Jit is imported here and not before.

    Raises
    ------
    SetupError
        `drjit` was asked for and the machine lacks something.
    """
    if name == "numpy":
        return NumpyEngine()
    try:
        from rislam_rt.slam.nested.particles.drjit_engine import DrJitEngine

        return DrJitEngine()
    except SetupError:
        if name == "drjit":
            raise
        return NumpyEngine()
