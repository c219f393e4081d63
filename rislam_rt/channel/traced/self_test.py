"""Self-test of this machine's tracer: a small box traced from end to end."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from rislam_rt.channel.traced.channel import TracedChannel
from rislam_rt.model import Body, Material, RadioConfig, Reflector, Scene, Trajectory

_SIZE = np.array([5.0, 4.0, 3.0])
_POSITION = np.array([[1.7, 2.3, 1.1]])
_BODY = Body(np.array([-0.04, -0.02, 0.01]), np.array([0.05, 0.03, -0.02]))


@dataclass(frozen=True, slots=True)
class SelfTest:
    """Outcome of the ray tracer's self-test in a small box: number of paths, errors of their gains, time."""

    num_paths: int
    """Paths that the tracer found."""
    expected_paths: int
    """25: the mirror lattice of a box up to two bounces, 1 + 6 + 18."""
    los_error_db: float
    """Error [dB] of the direct path's gain against lambda / (4 pi d)."""
    wall_error_db: float
    """Largest error [dB] of the single bounces' gains against R lambda / (4 pi d), d from the six mirror images."""
    seconds: float
    """Time [s] that the test took."""

    @property
    def ok(self) -> bool:
        """Whether the self-test found all paths with their gains (float32 precision: 1e-3 dB leaves a factor of 30)."""
        return self.num_paths == self.expected_paths and max(self.los_error_db, self.wall_error_db) < 1e-3


def trace_small_box() -> SelfTest:
    """Trace LOS and wall returns up to two bounces in a box held in memory, and compare with theory.

    Raises
    ------
    SetupError
        The machine lacks something that the tracer needs.
    """
    start = perf_counter()
    radio, reflection = RadioConfig(), 0.7
    still = Trajectory(np.zeros(1), _POSITION, np.zeros((1, 3)), np.zeros(1), _BODY)
    box = Scene("small box", (_box(reflection),), (), None, still)
    paths = TracedChannel(box, radio, depth=2).paths(still)
    gain = np.sort(np.abs(paths.gain[0, paths.valid[0] & (paths.num_vertices <= 1)]))[::-1]
    images = np.repeat(still.rx, 7, axis=0)
    for axis in range(3):
        images[2 * axis + 1, axis] *= -1.0
        images[2 * axis + 2, axis] = 2.0 * _SIZE[axis] - images[2 * axis + 2, axis]
    expected = radio.wavelength / (4.0 * np.pi * np.linalg.norm(images - still.tx, axis=1))
    expected[1:] *= reflection
    expected = np.sort(expected)[::-1]
    errors = np.abs(20.0 * np.log10(gain / expected)) if len(gain) == len(expected) else np.full(7, np.inf)
    return SelfTest(int(paths.valid.sum()), 25, float(errors[0]), float(errors[1:].max()), perf_counter() - start)


def _box(reflection: float) -> Reflector:
    """Room of the self-test: a closed box as one mesh of six planes, two triangles each."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * _SIZE
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([[a, b, c] for a, b, c, _ in quads] + [[a, c, d] for a, _, c, d in quads])
    return Reflector("box", corners, faces, Material(reflection=reflection))
