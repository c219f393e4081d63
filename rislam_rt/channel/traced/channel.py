"""The traced channel: legs of a whole trajectory from few solves, joined into paths."""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import join_rows
from rislam_rt.channel.occluders import ALONE
from rislam_rt.channel.path_composition import compose_paths
from rislam_rt.channel.specular_legs import SpecularLegs
from rislam_rt.channel.traced.float32_limits import room_center
from rislam_rt.channel.traced.leg_query import FoundLegs, LegQuery, QueryBatch, build_batch
from rislam_rt.channel.traced.path_geometry import refined_geometry, traced_geometry
from rislam_rt.channel.traced.tracer_startup import start_tracer
from rislam_rt.channel.traced.wall_sequences import CandidateIndices, in_blocks, wall_sides
from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import ConfigError, expect
from rislam_rt.model import Antennas, Paths, RadioConfig, RisCode, Scene, Trajectory
from rislam_rt.ris import rephase

BLOCK_ROWS = 200_000
"""Candidates traced at once: bounds the memory of a solve."""


class TracedChannel:
    """All paths of a room over a trajectory, traced with Sionna RT on the room's meshes.

    Parameters
    ----------
    scene, radio
        The room, and the radio that decides carrier and antenna gains.
    depth
        Largest number of wall bounces on a path, both legs together.
    refine
        Recompute the bounce points of what the tracer found in float64 on the walls' planes; `Paths.source` says
        `traced, refined`, and which sequences were asked about. Without it the tracer's own float32 vertices stand,
        good to some micrometres (a segment of a millimetre then has a direction of three digits, so reflection is
        computed on the refined points in either case).

    antennas
        Patterns and polarisation of the agent's antennas, if they are others than the radio's.

    The channel holds the tracer's scene; `paths` may be called for any number of trajectories.
    """

    def __init__(
        self, scene: Scene, radio: RadioConfig, depth: int = 2, *, refine: bool = True, antennas: Antennas | None = None
    ) -> None:
        expect("scene", scene, Scene)
        expect("radio", radio, RadioConfig)
        expect("depth", depth, int)
        if depth < 0:
            raise ConfigError(f"depth: {depth} received; give the largest number of bounces, 0 or more")
        start_tracer()
        from rislam_rt.channel.traced.tracer_scene import build_tracer_scene

        self.scene = scene
        self.radio = radio
        self.depth = depth
        self.refine = refine
        self.antennas = antennas or radio.antennas
        self.walls = build_walls(scene)
        self._sides = wall_sides(self.walls)
        occluders = {n: s.shade.triangles for n, s in enumerate(scene.scatterers) if s.shade is not None}
        if scene.occluders:
            occluders[ALONE] = np.concatenate([shade.triangles for shade in scene.occluders])
        self.tracer_scene = build_tracer_scene(self.walls, radio.carrier, room_center(scene), occluders)

    def paths(self, trajectory: Trajectory) -> Paths:
        """Paths of every cycle of a trajectory through the traced channel, with the panel's code at level 0."""
        expect("trajectory", trajectory, Trajectory)
        tx, rx, heading = trajectory.tx, trajectory.rx, trajectory.heading
        queries = [LegQuery(tx, rx, heading, to_rx=True)]
        for number, point in enumerate(self.scene.landmark_positions):
            panel, behind, front = self.scene.panel_number(number), -1, None
            if panel >= 0:
                behind, front = self.walls.hosts[panel], self.scene.panels[panel].spec.normal
            spared = number if number in self.tracer_scene.occluders else -1
            for from_rx, device in ((False, tx), (True, rx)):
                queries.append(LegQuery(device, point[None], heading, from_rx, False, behind, front, spared))
        (direct, *legs), complete = self._trace(queries)
        tx_legs, rx_legs = legs[0::2], legs[1::2]
        searched = "all wall sequences" if complete else "wall sequences in cones"
        source = f"traced, refined, {searched}" if self.refine else f"traced, {searched}"
        return compose_paths(self.scene, self.radio, self.walls, self.depth, direct, tx_legs, rx_legs, source)

    def respond(self, paths: Paths, code: RisCode) -> Paths:
        """The traced paths with their gains under another panel code, without tracing again."""
        return rephase(paths, code)

    def _trace(self, queries: Sequence[LegQuery]) -> tuple[list[SpecularLegs], bool]:
        """Trace the legs of several queries for the traced channel; also whether all wall sequences were tried."""
        # Queries that leave the same occluder out are solved together, block by block.
        legs: dict[int, SpecularLegs] = {}
        complete = True
        for spared in dict.fromkeys(query.spared for query in queries):
            chosen = [number for number, query in enumerate(queries) if query.spared == spared]
            depth = self.depth if len(self.walls) else 0
            batch = build_batch([queries[number] for number in chosen], self.tracer_scene, self._sides, depth)
            complete &= batch.complete
            blocks = in_blocks(batch.candidates(self.tracer_scene), BLOCK_ROWS)
            found = join_rows(self._solve(batch, rows, spared) for rows in blocks)
            legs |= dict(zip(chosen, batch.legs(found), strict=True))
        return [legs[number] for number in range(len(queries))], complete

    def _solve(self, batch: QueryBatch, candidates: CandidateIndices, spared: int) -> FoundLegs:
        """Legs of the traced channel: what the tracer confirms of candidates, with geometry and coefficients."""
        from rislam_rt.channel.traced.fields import leg_coefficients
        from rislam_rt.channel.traced.visibility import visible_rows

        rows, vertices = visible_rows(
            self.tracer_scene, batch.all_sequences, batch.far, batch.device, candidates, spared
        )
        sequences, ends = batch.all_sequences[rows.sequence], batch.ends(rows)
        exact = refined_geometry(self.walls, sequences, ends.device, ends.far)
        coefficient = leg_coefficients(self.tracer_scene, self.walls, sequences, ends, exact, self.antennas)
        geometry = exact if self.refine else traced_geometry(sequences, ends.device, ends.far, vertices)
        return FoundLegs(rows, geometry, coefficient)
