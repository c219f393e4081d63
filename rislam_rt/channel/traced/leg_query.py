"""Queries for specular legs between many devices and their far ends, batched for the tracer, and its answers as
legs."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, take_rows
from rislam_rt.channel.specular_legs import SpecularLegs
from rislam_rt.channel.traced.float32_limits import LIFT
from rislam_rt.channel.traced.path_geometry import PathGeometry
from rislam_rt.channel.traced.wall_sequences import CandidateIndices, point_sides, possible_sequences
from rislam_rt.channel.walls import Walls
from rislam_rt.constants import SURFACE_TOLERANCE

if TYPE_CHECKING:
    from rislam_rt.channel.traced.tracer_scene import TracerScene


class LegQuery(NamedTuple):
    """Query for the specular legs from devices (N, 3) each to its far end (N, 3), or all to one (1, 3) [m]."""

    device: Floats
    far: Floats
    heading: Floats
    """(N,) [rad] of the agent."""
    from_rx: bool = False
    """Whether the devices are the Rx (else the Tx)."""
    to_rx: bool = False
    """Whether the far ends are the Rx (else a landmark)."""
    host: int = -1
    """Wall behind a panel at the far end: no bounce on it next to the panel."""
    front: Floats | None = None
    """(3,) normal of that panel, which sees only what lies before it."""
    spared: int = -1
    """Number of the scatterer at the far end, if it has an occluding mesh, which does not hide its own centre; -1 for
    none."""

    @property
    def paired(self) -> bool:
        """Whether every device of a query has a far end of its own."""
        return len(self.far) != 1


class LegEndpoints(NamedTuple):
    """Positions of the two ends of N legs, the agent's heading, and which ends are the Rx."""

    device: Floats
    """(N, 3) [m]."""
    far: Floats
    """(N, 3) [m]."""
    heading: Floats
    """(N,) [rad]."""
    from_rx: Booleans
    """(N,) whether the device is the Rx (else the Tx)."""
    to_rx: Booleans
    """(N,) whether the far end is the Rx (else a landmark)."""


class FoundLegs(NamedTuple):
    """N specular legs that the tracer confirmed: candidate, geometry and field coefficient of each."""

    rows: CandidateIndices
    geometry: PathGeometry
    coefficient: Complexes
    """(N,) field without spreading loss and carrier phase: reflections and antenna patterns."""


class QueryBatch(NamedTuple):
    """Several queries for legs in one set of tables, so that one solve of the tracer serves them all."""

    queries: Sequence[LegQuery]
    sequences: list[Integers]
    """Possible wall sequences (S, D) of each query."""
    device: Floats
    """(N, 3) [m] devices of all queries."""
    far: Floats
    """(F, 3) [m] far ends of all queries, for the tracer: lifted off host walls."""
    complete: bool
    """Whether the sequences are all that the walls' sides allow; else cones have ruled out some."""

    @property
    def all_sequences(self) -> Integers:
        """Possible wall sequences (S, D) of all queries for legs, one query after the other."""
        return np.concatenate(self.sequences)

    def candidates(self, tracer_scene: "TracerScene") -> Iterator[CandidateIndices]:
        """Yield the candidates of all queries that survive culling."""
        from rislam_rt.channel.traced.culling import cull_candidates

        first_device = first_far = first_sequence = 0
        for query, sequences in zip(self.queries, self.sequences, strict=True):
            for device, sequence in cull_candidates(tracer_scene, sequences, query.device, query.far):
                far = device if query.paired else np.zeros_like(device)
                yield CandidateIndices(far + first_far, device + first_device, sequence + first_sequence)
            first_device += len(query.device)
            first_far += len(query.far)
            first_sequence += len(sequences)

    def ends(self, rows: CandidateIndices) -> LegEndpoints:
        """Positions and antennas at the two ends of each leg queried in `rows`."""
        sizes = [len(query.device) for query in self.queries]
        far = np.concatenate([query.far for query in self.queries])
        heading = np.concatenate([query.heading for query in self.queries])
        from_rx = np.repeat([query.from_rx for query in self.queries], sizes)
        to_rx = np.repeat([query.to_rx for query in self.queries], sizes)
        device = rows.device
        return LegEndpoints(self.device[device], far[rows.far], heading[device], from_rx[device], to_rx[device])

    def legs(self, found: FoundLegs) -> list[SpecularLegs]:
        """Split the legs that the tracer found by query."""
        result = []
        first_device = first_sequence = 0
        for query, sequences in zip(self.queries, self.sequences, strict=True):
            here = found.rows.sequence - first_sequence
            answer = take_rows(found, np.flatnonzero((here >= 0) & (here < len(sequences))))
            rows = answer.rows
            result.append(
                _as_legs(query, sequences, rows.device - first_device, rows.sequence - first_sequence, answer)
            )
            first_device += len(query.device)
            first_sequence += len(sequences)
        return result


def build_batch(queries: Sequence[LegQuery], tracer_scene: "TracerScene", sides: Integers, depth: int) -> QueryBatch:
    """Combine queries for legs into one batch, each with its possible wall sequences of up to `depth` bounces."""
    from rislam_rt.channel.traced.cones import build_cones

    walls, sequences, complete = tracer_scene.walls, [], True
    for query in queries:
        device_side, far_side = (np.bitwise_or.reduce(point_sides(walls, p)) for p in (query.device, query.far))
        cones = partial(build_cones, tracer_scene, query.device, query.far)
        table, all_of_them = possible_sequences(sides, device_side, far_side, depth, walls.beside(query.host), cones)
        sequences.append(table)
        complete &= all_of_them
    device = np.concatenate([query.device for query in queries])
    far = np.concatenate([_lifted(query, walls) for query in queries])
    return QueryBatch(queries, sequences, device, far, complete)


def _lifted(query: LegQuery, walls: Walls) -> Floats:
    """Far ends (F, 3) [m] of a query, a panel's moved to at least `LIFT` in front of its host wall."""
    if query.host < 0 or query.front is None:
        return query.far
    outward = np.copysign(1.0, walls.normal[query.host] @ query.front)
    height = outward * (query.far @ walls.normal[query.host] - walls.offset[query.host])
    return query.far + np.maximum(LIFT - height, 0.0)[:, None] * query.front


def _as_legs(
    query: LegQuery, sequences: Integers, device: Integers, column: Integers, found: FoundLegs
) -> SpecularLegs:
    """Arrange the found legs of a query by device and wall sequence, one column for each that some device has."""
    geometry = found.geometry
    keep = np.ones(len(device), dtype=np.bool_)
    if query.front is not None:
        keep = geometry.at_far_end @ query.front > SURFACE_TOLERANCE
    columns, place = np.unique(column[keep], return_inverse=True)
    shape = len(query.device), len(columns)

    def dense(part: Any) -> Any:
        values = np.zeros(shape + part.shape[1:], dtype=part.dtype)
        values[device[keep], place] = part[keep]
        return values

    return SpecularLegs(
        walls=sequences[columns], valid=dense(np.ones(len(device), dtype=np.bool_)), length=dense(geometry.length),
        at_device=dense(geometry.at_device), at_far_end=dense(geometry.at_far_end),
        coefficient=dense(found.coefficient), vertices=dense(geometry.vertices),
    )  # fmt: skip
