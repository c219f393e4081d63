"""Channel by the image-source method: exact specular paths of a room of planar walls, as a `Channel`."""

from dataclasses import dataclass, field

from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source.antennas import LegEnds
from rislam_rt.channel.image_source.fresnel import Coatings, build_coatings
from rislam_rt.channel.image_source.leg_candidates import SEARCHES, SequenceSearch, build_search
from rislam_rt.channel.image_source.mirror_images import find_legs
from rislam_rt.channel.image_source.wall_facets import WallFacets, build_facets
from rislam_rt.channel.path_composition import compose_paths
from rislam_rt.channel.specular_legs import SpecularLegs
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.errors import ConfigError, expect
from rislam_rt.model import Antennas, Paths, RadioConfig, RisCode, Scene, Trajectory
from rislam_rt.ris import rephase


@dataclass(frozen=True, eq=False)
class ImageSourceChannel:
    """Channel of a room of planar walls by the image-source method: all paths up to `depth` bounces, with exact
    visibility tests in float64.

    `search` says how sequences are found: `exhaustive` tries all that the walls' sides allow, `beams` those that
    mirrored beams leave possible, which loses none; `auto` takes the first where sequences are few. `Paths.source`
    names the one taken.

    Raises
    ------
    ConfigError
        The depth is negative, or the search unknown.
    SceneError
        A wall's material is not specified at the carrier.
    """

    scene: Scene
    radio: RadioConfig
    depth: int = 2
    search: str = "auto"
    antennas: Antennas | None = None
    """Patterns and polarisation of the agent's antennas, if they are others than the radio's."""
    walls: Walls = field(init=False)
    facets: WallFacets = field(init=False)
    coatings: Coatings = field(init=False)
    sequence_search: SequenceSearch = field(init=False)

    def __post_init__(self) -> None:
        expect("scene", self.scene, Scene)
        expect("radio", self.radio, RadioConfig)
        expect("depth", self.depth, int)
        if self.depth < 0:
            raise ConfigError(f"depth: {self.depth} received; give 0 or more wall bounces")
        if self.search not in SEARCHES:
            raise ConfigError(f"search: '{self.search}' received; give one of {', '.join(SEARCHES)}")
        object.__setattr__(self, "walls", build_walls(self.scene))
        object.__setattr__(self, "facets", build_facets(self.walls))
        object.__setattr__(self, "coatings", build_coatings(self.walls.material, self.radio.carrier))
        object.__setattr__(self, "sequence_search", build_search(self.facets, self.depth, self.search))

    def paths(self, trajectory: Trajectory) -> Paths:
        """Paths of every cycle of a trajectory by the image-source method, with the panel's code at level 0."""
        expect("trajectory", trajectory, Trajectory)
        tx, rx = trajectory.tx, trajectory.rx
        ends = self.antennas or self.radio.antennas
        pairs = (ends.of_tx, ends.of_rx), (ends.of_tx, ends.of_landmark), (ends.of_rx, ends.of_landmark)
        at_direct, at_tx, at_rx = (None if ends.plain else LegEnds(*pair, trajectory.heading) for pair in pairs)
        direct = find_legs(self.sequence_search, self.coatings, tx, rx, self.depth, terminals=at_direct)
        landmarks = range(len(self.scene.landmarks))
        tx_legs = [self._landmark_legs(tx, number, at_tx) for number in landmarks]
        rx_legs = [self._landmark_legs(rx, number, at_rx) for number in landmarks]
        source = f"image source, {self.sequence_search.words}"
        return compose_paths(self.scene, self.radio, self.walls, self.depth, direct, tx_legs, rx_legs, source)

    def respond(self, paths: Paths, code: RisCode) -> Paths:
        """The image-source paths with their gains under another panel code, without a new search."""
        return rephase(paths, code)

    def _landmark_legs(self, device: Floats, number: int, terminals: LegEnds | None) -> SpecularLegs:
        """Specular legs of the image-source channel from device positions (K, 3) [m] to one landmark; those to a panel
        arrive at its front."""
        panel, point = self.scene.panel_number(number), self.scene.landmark_positions[[number]]
        host, front, landmark = -1, None, number
        if panel >= 0:
            host, front, landmark = self.walls.hosts[panel], self.scene.panels[panel].spec.normal, -1
        return find_legs(
            self.sequence_search, self.coatings, device, point, self.depth, host=host, front=front, landmark=landmark,
            terminals=terminals,
        )  # fmt: skip
