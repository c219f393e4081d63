"""Engine that weighs and resamples landmark particles by fused Dr.Jit kernels, for CPU (LLVM) and GPU (CUDA).

A lane of the machine takes some of the particles of one agent particle, four at a time: what depends on the agent
particle alone is loaded once a lane and not once a particle, and memory is read in packets. Sums are kept a lane and
put together in double precision outside, in a fixed order, so that the result is the same with any number of threads.

Passes over particles wait for memory, not arithmetic: points are quantised to 21-bit numbers, three in 8 bytes. A step
is one millionth of a block's largest offset, as fine as single precision is there: x in the upper 21 bits of the first
word, y in those of the second, and z in what both have left, its upper 11 bits in the first word.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.nested.particles.landmark_cloud import (
    DEEPEST,
    HOPELESS,
    SECOND,
    Cloud,
    CloudSums,
    Kernel,
    combine,
    restoring_map,
)
from rislam_rt.slam.nested.particles.sightline import Kinds, log_likelihood
from rislam_rt.tracer_backend import prepare_backend

TOP = 2**20 - 1
"""Largest quantised coordinate, in steps."""
WORDS = 2
"""Number of 32-bit words of a quantised point."""
LOW = 2**11 - 1
"""Mask of the 11 bits of a word that x and y leave to z."""
FINEST = 1e-12
"""Least quantisation step [m]."""
Words = npt.NDArray[np.uint32]
"""Arrays of 32-bit words."""


class Quantisation(NamedTuple):
    """Quantised points of a landmark's cloud."""

    words: Any
    """Blocks of M points, two words each."""
    step: Floats
    """Quantisation step (B,) [m] of each block."""


def steps(reach: Floats) -> Floats:
    """Quantisation steps [m] of the Dr.Jit engine's particles that hold offsets up to `reach` [m]."""
    return np.maximum(reach / TOP, FINEST)


def encode(points: Floats, step: Floats) -> Words:
    """Quantised words (B, M, 2) of the Dr.Jit engine's particles (B, M, 3), with a step [m] for each block (B,)."""
    whole = np.clip(np.rint(points / step[:, None, None]), -TOP, TOP).astype(np.int32).view(np.uint32)
    first, second = join(whole[..., 0], whole[..., 1], whole[..., 2])
    return np.stack([first, second], axis=-1).astype(np.uint32)


def decode(words: Words, step: Floats) -> Floats:
    """Particles (B, M, 3) [m] from the Dr.Jit engine's quantised words; undoes `encode`."""
    parts = split(words[..., 0], words[..., 1])
    return np.stack([part.astype(np.uint32).view(np.int32) >> 11 for part in parts], axis=-1) * step[:, None, None]


def join(x: Any, y: Any, z: Any) -> tuple[Any, Any]:
    """Pack three signed 21-bit coordinates of an engine's particles into two 32-bit words, for Dr.Jit or numpy."""
    return (x << 11) | ((z >> 10) & LOW), (y << 11) | ((z & 1023) << 1)


def split(first: Any, second: Any) -> tuple[Any, Any, Any]:
    """Unpack the engine's two 32-bit words into three coordinates in the upper 21 bits of a word; a shift of 11 drops
    the rest."""
    return first, second, (first << 21) | ((second & LOW) << 10)


PACKET = 4
"""Number of particles that a lane handles at once; M must be a multiple of it."""
LANES = {"llvm": 8, "cuda": 64}
"""Largest number of lanes per agent particle: on a CPU about the fastest, on a GPU enough to fill it."""


class DrJitEngine:
    """Engine of landmark particles in Dr.Jit, on the device that `rislam_rt.tracer_backend` chose."""

    def __init__(self) -> None:
        self.name = prepare_backend().variant.split("_")[0]
        self._dr: Any = import_module("drjit")
        types: Any = import_module(f"drjit.{self.name}")
        self._float, self._int, self._four = types.Float, types.UInt32, types.Array4f
        self._four_int, self._four_signed, self._two_int = types.Array4u, types.Array4i, types.Array2u

    def build(self, points: Floats, log_weight: Floats, block: Integers, row: Integers) -> Cloud:
        """Build a landmark's cloud in Dr.Jit, of blocks of points (B, M, 3) [m] and rows of log weights (R, M)."""
        step = steps(np.abs(points).max(axis=(1, 2)))
        grid = Quantisation(self._int(encode(points, step).ravel()), step)
        total = np.logaddexp.reduce(log_weight, axis=1)[row]
        return Cloud(grid, self._upload(log_weight), block, row, total, points.shape[1])

    def read(self, cloud: Cloud) -> tuple[Floats, Floats]:
        """Offsets (N, M, 3) [m] and normalised log weights (N, M) of every agent particle from Dr.Jit, for tests and
        pictures."""
        points = decode(cloud.points.words.numpy().reshape(-1, cloud.size, WORDS), cloud.points.step)[cloud.block]
        log_weight = cloud.log_weight.numpy().reshape(-1, cloud.size)[cloud.row]
        return points, log_weight - cloud.log_total[:, None]

    def weigh(self, cloud: Cloud, kinds: Kinds, constants: Floats) -> tuple[Cloud, CloudSums]:
        """Multiply the weights of a cloud in a Dr.Jit kernel by the likelihood of some returns, given by constants (K,
        N) float32."""
        dr, count, size = self._dr, len(cloud.block), cloud.size
        agent, place, lanes = self._lanes(count, size)
        known = self._known(constants, agent)
        shift, grain = self._known(np.stack([cloud.log_total, cloud.points.step[cloud.block]]), agent)
        packets = size // PACKET
        points_at = self._look_up(cloud.block, agent) * size + place * PACKET
        weight_at = self._look_up(cloud.row, agent) * packets + place
        new = dr.empty(self._float, count * size)

        def body(step: Any, top: Any, *sums: Any) -> tuple[Any, ...]:
            x, y, z = (grain * part for part in self._packet(cloud.points.words, points_at + step * PACKET))
            weight = dr.gather(self._four, cloud.log_weight, weight_at + step) - shift
            if kinds:
                weight += log_likelihood(kinds, known.__getitem__, x, y, z, dr.rsqrt)
            weight = dr.select(weight > HOPELESS, weight, HOPELESS)
            dr.scatter(new, weight, agent * packets + place + step)
            return (step + lanes, *self._add(top, sums, weight, x, y, z))

        start = (self._int(0), self._float(2.0 * HOPELESS), *[self._float(0.0) for _ in range(11)])
        flat = self._loop(start, packets, body)[1:]
        dr.eval(new, *flat)
        found = combine(np.stack([part.numpy().reshape(count, lanes) for part in flat]))
        return cloud._replace(log_weight=new, row=np.arange(count), log_total=found.log_total), found

    def resample(self, cloud: Cloud, covariance: Floats, size: int, kernel: Kernel) -> Cloud:
        """Resample a cloud in a Dr.Jit kernel to `size` equally weighted particles per agent particle, of mean 0,
        covariance (N, 3, 3)."""
        count = len(cloud.block)
        # drawn anew each time: as a number in the code it would have a kernel compiled for each that was not yet drawn
        kernel = kernel._replace(offset=self._dr.opaque(self._int, kernel.offset))
        children = self._draw(cloud, self._ancestors(cloud, size, kernel.comb), size, kernel.stride)
        grain = cloud.points.step[cloud.block]
        first, second, reach = self._mixed_moments(children, count, size, kernel)
        first, second, reach = grain[:, None] * first, (grain**2)[:, None, None] * second, grain * reach
        turn = restoring_map(covariance, second - first[:, :, None] * first[:, None, :])
        # the largest offset after the map, at most: what it does to a corner of the box that holds the points
        step = steps((reach + np.abs(first).max(axis=1)) * np.abs(turn).sum(axis=2).max(axis=1))
        inverse = 1.0 / step[:, None]
        points = self._mix(
            children, count, size, kernel, first / grain[:, None], turn * (grain * inverse[:, 0])[:, None, None]
        )
        points = Quantisation(points, step)
        uniform = self._upload(np.full(size, -np.log(size)))
        return Cloud(points, uniform, np.arange(count), np.zeros(count, dtype=np.int64), np.zeros(count), size)

    def compact(self, cloud: Cloud) -> Cloud:
        """Copy a cloud in Dr.Jit without the blocks and rows that no agent particle points at."""
        used, block = np.unique(cloud.block, return_inverse=True)
        rows, row = np.unique(cloud.row, return_inverse=True)
        words = self._pick(cloud.points.words, self._four_int, used, WORDS * cloud.size // PACKET)
        points = Quantisation(words, cloud.points.step[used])
        log_weight = self._pick(cloud.log_weight, self._four, rows, cloud.size // PACKET)
        return cloud._replace(points=points, log_weight=log_weight, block=block, row=row)

    def _add(self, top: Any, sums: tuple[Any, ...], log_weight: Any, x: Any, y: Any, z: Any) -> tuple[Any, ...]:
        """Add a packet of particles to a lane's sums in a Dr.Jit kernel, relative to the largest log weight so far."""
        dr = self._dr
        peak = dr.maximum(top, dr.max(log_weight))
        scale = dr.exp(dr.maximum(top - peak, DEEPEST))
        weight = dr.exp(dr.maximum(log_weight - peak, DEEPEST))
        wx, wy, wz = weight * x, weight * y, weight * z
        total, square, *rest = sums
        pairs = ((weight, x), (weight, y), (weight, z), (wx, x), (wy, y), (wz, z), (wx, y), (wx, z), (wy, z))
        return (
            peak,
            dr.fma(total, scale, dr.sum(weight)),
            self._dot(square * (scale * scale), weight, weight),
            *(self._dot(old * scale, a, b) for old, (a, b) in zip(rest, pairs, strict=True)),
        )

    def _dot(self, start: Any, first: Any, second: Any) -> Any:
        """Add the products of two packets to `start` in a Dr.Jit kernel, a sum a lane: all sums stay in registers."""
        for a, b in zip(first, second, strict=True):
            start = self._dr.fma(a, b, start)
        return start

    def _ancestors(self, cloud: Cloud, size: int, comb: Floats) -> Any:
        """Ancestors (N * size,) in Dr.Jit by systematic resampling: first children marked, a running maximum fills."""
        dr, count, old = self._dr, len(cloud.block), cloud.size
        agent, place, lanes = self._lanes(count, old)
        packets = old // PACKET
        log_total, start = self._known(np.stack([cloud.log_total, comb]), agent)
        weight_at, own = self._look_up(cloud.row, agent) * packets, agent * packets
        weight = dr.empty(self._float, count * old)

        def expand(step: Any) -> tuple[Any, ...]:
            log_weight = dr.gather(self._four, cloud.log_weight, weight_at + place + step) - log_total
            dr.scatter(weight, dr.exp(dr.maximum(log_weight, -80.0)), own + place + step)
            return (step + lanes,)

        self._loop((self._int(0),), packets, expand)
        edges = dr.block_prefix_sum(weight, old, exclusive=False)
        dr.eval(edges)
        marks = dr.zeros(self._int, count * size)

        def mark(step: Any) -> tuple[Any, ...]:
            here = place + step
            edge = dr.gather(self._four, edges, own + here)
            left = dr.gather(self._four, edges, own + dr.maximum(here, 1) - 1)
            low = dr.select(here > 0, left[3], 0.0)
            for k in range(PACKET):
                end = (here == packets - 1) & (k == PACKET - 1)
                high = dr.select(end, 2.0, edge[k])
                first = dr.clip(dr.ceil(low * size - start), 0.0, size)
                last = dr.clip(dr.ceil(high * size - start), 0.0, size)
                dr.scatter(marks, here * PACKET + k, agent * size + self._int(first), last > first)
                low = high
            return (step + lanes,)

        self._loop((self._int(0),), packets, mark)
        ancestors = dr.block_prefix_reduce(dr.ReduceOp.Max, marks, size, exclusive=False)
        dr.eval(ancestors)
        return ancestors

    def _draw(self, cloud: Cloud, ancestors: Any, size: int, stride: int) -> Any:
        """Copy the points of resampled ancestors in Dr.Jit, children of one parent put far apart."""
        dr, count = self._dr, len(cloud.block)
        agent, place, lanes = self._lanes(count, size)
        packets, block = size // PACKET, self._look_up(cloud.block, agent) * cloud.size
        children = dr.empty(self._int, count * size * WORDS)

        def body(step: Any) -> tuple[Any, ...]:
            parents = dr.gather(self._four_int, ancestors, agent * packets + place + step)
            for k in range(PACKET):
                point = dr.gather(self._two_int, cloud.points.words, block + parents[k])
                child = ((place + step) * PACKET + k) * stride % size
                dr.scatter(children, point, agent * size + child)
            return (step + lanes,)

        self._loop((self._int(0),), packets, body)
        dr.eval(children)
        return children

    def _mixed(self, children: Any, at: Any, base: Any, size: int, kernel: Kernel) -> list[Any]:
        """Four points at packet `at` of a Dr.Jit kernel, of agent particles whose points begin at `base`, mixed with
        their partners."""
        partner = at * PACKET + kernel.offset
        partner = self._dr.select(partner >= size, partner - size, partner)
        own, other = self._packet(children, base + at * PACKET), self._packet(children, base + partner)
        keep = float(np.sqrt(1.0 - kernel.width**2))
        return [keep * a + kernel.width * b for a, b in zip(own, other, strict=True)]

    def _mixed_moments(self, children: Any, count: int, size: int, kernel: Kernel) -> tuple[Floats, Floats, Floats]:
        """By Dr.Jit: mean (N, 3), second moment (N, 3, 3), largest coordinate (N,) of the mixed particles, in steps."""
        dr = self._dr
        agent, place, lanes = self._lanes(count, size)

        def body(step: Any, most: Any, *sums: Any) -> tuple[Any, ...]:
            x, y, z = self._mixed(children, place + step, agent * size, size, kernel)
            most = dr.maximum(most, dr.max(dr.maximum(dr.maximum(abs(x), abs(y)), abs(z))))
            first = [old + dr.sum(term) for old, term in zip(sums[:3], (x, y, z), strict=True)]
            pairs = ((x, x), (y, y), (z, z), (x, y), (x, z), (y, z))
            second = [self._dot(old, a, b) for old, (a, b) in zip(sums[3:], pairs, strict=True)]
            return (step + lanes, most, *first, *second)

        start = (self._int(0), *[self._float(0.0) for _ in range(10)])
        flat = self._loop(start, size // PACKET, body)[1:]
        dr.eval(*flat)
        lane_sums = np.stack([part.numpy().reshape(count, lanes) for part in flat])
        sums = lane_sums[1:].sum(axis=2, dtype=np.float64) / size
        return sums[:3].T, sums[3:][SECOND].transpose(2, 0, 1), lane_sums[0].max(axis=1).astype(np.float64)

    def _mix(self, children: Any, count: int, size: int, kernel: Kernel, mean: Floats, turn: Floats) -> Any:
        """Quantised words, in Dr.Jit, of the mixed points less their means (N, 3), turned, stretched to new steps by
        (N, 3, 3)."""
        dr = self._dr
        agent, place, lanes = self._lanes(count, size)
        known = self._known(np.concatenate([mean, turn.reshape(count, 9)], axis=1).T, agent)
        moved = dr.empty(self._int, count * size * WORDS)

        def body(step: Any) -> tuple[Any, ...]:
            mixed = self._mixed(children, place + step, agent * size, size, kernel)
            x, y, z = (part - known[axis] for axis, part in enumerate(mixed))
            new = [known[k] * x + known[k + 1] * y + known[k + 2] * z for k in (3, 6, 9)]
            whole = [self._four_signed(dr.clip(dr.round(part), -TOP, TOP)) for part in new]
            first, second = join(*(dr.reinterpret_array(self._four_int, part) for part in whole))
            for k in range(0, PACKET, 2):
                two = self._four_int(first[k], second[k], first[k + 1], second[k + 1])
                dr.scatter(moved, two, (agent * size + (place + step) * PACKET + k) // 2)
            return (step + lanes,)

        self._loop((self._int(0),), size // PACKET, body)
        dr.eval(moved)
        return moved

    def _packet(self, points: Any, at: Any) -> list[Any]:
        """Coordinates x, y and z, in steps, of four neighbouring points in Dr.Jit."""
        a, b = (self._dr.gather(self._four_int, points, at // 2 + k) for k in range(2))
        parts = split(self._four_int(a[0], a[2], b[0], b[2]), self._four_int(a[1], a[3], b[1], b[3]))
        return [self._four(self._dr.reinterpret_array(self._four_signed, part) >> 11) for part in parts]

    def _loop(self, start: tuple[Any, ...], packets: int, body: Callable[..., tuple[Any, ...]]) -> tuple[Any, ...]:
        """Run `body` in a Dr.Jit kernel on every lane's packets; the first of the state is the lane's step, the same
        for all lanes."""
        return self._dr.while_loop(start, lambda step, *_: step < packets, body)

    def _lanes(self, count: int, size: int) -> tuple[Any, Any, int]:
        """Agent particle of each Dr.Jit lane, the lane's place among those of that particle, and how many those are."""
        packets = size // PACKET
        lanes = max(k for k in range(1, LANES[self.name] + 1) if packets % k == 0)
        lane = self._dr.arange(self._int, count * lanes)
        agent = lane // lanes
        return agent, lane - agent * lanes, lanes

    def _known(self, constants: Floats, agent: Any) -> list[Any]:
        """Constants (K, N) of the agent particles, gathered in Dr.Jit for each lane."""
        table, count = self._upload(constants), constants.shape[1]
        return [self._dr.gather(self._float, table, agent + k * count) for k in range(len(constants))]

    def _look_up(self, table: Integers, agent: Any) -> Any:
        """Entries of an integer table (N,) in Dr.Jit for each lane's agent particle."""
        return self._dr.gather(self._int, self._int(table.astype(np.uint32)), agent)

    def _pick(self, part: Any, four: Any, blocks: Integers, packets: int) -> Any:
        """Copy some blocks of a Dr.Jit array, each of so many packets of the type `four`."""
        dr = self._dr
        index = dr.arange(self._int, len(blocks) * packets)
        block = index // packets
        picked = dr.empty(type(part), len(blocks) * packets * PACKET)
        dr.scatter(picked, dr.gather(four, part, self._look_up(blocks, block) * packets + index % packets), index)
        dr.eval(picked)
        return picked

    def _upload(self, values: Floats) -> Any:
        """Copy an array to Dr.Jit's device, flat and in float32."""
        return self._float(np.ascontiguousarray(values, dtype=np.float32).ravel())
