"""Link budget of each landmark along the trajectory: SNR margin, detection probability, why it is not detected.

Reasons are: occluded, behind the panel, below the array, not resolved, outside the receiver's window, too weak.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.adviser.forecast_codes import codes_of
from rislam_rt.arrays import Floats, Integers, take_rows
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import Received, receive
from rislam_rt.measurement.bound_receiver import NEGLIGIBLE
from rislam_rt.measurement.components import NoiselessComponents, merge, single
from rislam_rt.measurement.received_paths import HORIZON_MARGIN
from rislam_rt.measurement.slot_motion import split_by_code
from rislam_rt.model import Paths, RisCode, Scene, SensorModel
from rislam_rt.pipeline.specification.pipeline_spec import Settings
from rislam_rt.ris import rephase
from rislam_rt.scene.check.mesh_queries import crossings

WEAK = "too weak"
"""Reason where a path comes in that is below the detection threshold."""
OUTSIDE = "beyond the receiver's delays"
"""Reason where all paths arrive outside of the window of delays that the receiver looks at."""
CLEARANCE = 1e-6
"""Share of a line of sight left out at the landmark's end, where a panel lies on its own wall."""


class DetectionForecast(NamedTuple):
    """Forecast of the detection of L landmarks at one position under one RIS code."""

    probability: Floats
    """(L,) probability that at least one component comes from the landmark."""
    snr: Floats
    """(L,) SNR of the landmark's strongest path that the array receives, linear, over all antennas; 0 without one."""
    covered: Integers
    """(L,) column of the path in whose component the landmark's strongest one is merged; -1 if it has its own."""


def forecast_detection(paths: Paths, cycle: int, heading: float, settings: Settings) -> DetectionForecast:
    """Forecast the detection of all landmarks in one cycle of a room's paths, by the receiver of these settings.

    The same steps as a run's receiver: the side that the array receives, the two captures of alternated codes, paths
    that cannot be resolved joined, detection by Marcum's function; errors and false components left out, motion within
    the slot too.
    """
    radio, sensor = settings.radio, settings.sensor
    received = receive(paths, cycle, heading, radio, settings.receiver)
    count = len(paths.landmarks)
    missed, strongest, covered = np.ones(count), np.zeros(count), np.full(count, -1)
    for capture in split_by_code(received, settings.receiver):
        snr, owner = radio.integrated_snr(capture.gain), paths.landmark[capture.path]
        loud = take_rows(capture, snr > NEGLIGIBLE * sensor.threshold)
        parts = merge(loud, sensor) if settings.receiver.merge else single(loud)
        inside = sensor.in_window(parts.tau)
        chance = sensor.detection_probability(radio.integrated_snr(parts.gain)) * inside
        of_part = paths.landmark[parts.path]
        np.multiply.at(missed, of_part[of_part >= 0], 1.0 - chance[of_part >= 0])
        for landmark in range(count):
            own = np.flatnonzero(owner == landmark)
            row = int(own[np.argmax(snr[own])]) if len(own) else -1
            if row >= 0 and snr[row] > strongest[landmark]:
                strongest[landmark] = snr[row]
                covered[landmark] = _cover(loud, int(capture.path[row]), parts, sensor)
    return DetectionForecast(1.0 - missed, strongest, covered)


def _cover(loud: Received, path: int, parts: NoiselessComponents, sensor: SensorModel) -> int:
    """Column of the strongest path in whose component a path is forecast to merge; -1 if it has its own or is too
    weak."""
    row = np.flatnonzero(loud.path == path)
    if path in parts.path or not len(row):
        return -1
    leaders = np.flatnonzero(np.isin(loud.path, parts.path))
    points = np.column_stack([loud.tau, loud.direction[:, :2]])
    near = leaders[sensor.may_merge(points[leaders] - points[row])]
    return int(loud.path[near[np.argmax(np.abs(loud.gain[near]))]]) if len(near) else -1


class Reasons(NamedTuple):
    """Room with its paths at K positions and all surfaces that hide, to find why landmarks are not detected."""

    scene: Scene
    paths: Paths
    settings: Settings
    triangles: Floats
    """(T, 3, 3) [m] of all reflectors and occluders."""
    owner: tuple[str, ...]
    """(T,) name of the reflector or occluder of each triangle."""

    def why(self, number: int, place: int, margin_db: float, covered: int) -> str:
        """Reason, in a few words, why a landmark is not detected at a position of the agent; empty if none is found."""
        point, agent = self.scene.landmark_positions[number], self.scene.agent
        panel = self.scene.panel_number(number)
        front = self.scene.panels[panel] if panel >= 0 else None
        if front is not None and (agent.position[place] - front.center) @ front.spec.normal <= 0.0:
            return "the agent is behind the panel"
        blocker = self._blocker(point, place, number)
        weak = margin_db < 0.0
        own = (self.paths.landmark == number) & self.paths.valid[place]
        if blocker and weak:
            return f"shaded by '{blocker}'"
        array = self.settings.radio.array
        if own.any() and not array.receives(self.paths.arrival[place, own, 2], HORIZON_MARGIN).any():
            return "below the array, which hears from above only"
        if not weak and covered >= 0:
            return f"not to be told from {self.paths.label(covered)}"
        if not own.any():
            return "no path"
        if not self.settings.sensor.in_window(self.paths.tau[place, own]).any():
            return OUTSIDE
        return WEAK if weak else ""

    def _blocker(self, point: Floats, place: int, number: int) -> str:
        """Reason why a landmark is not detected: the mesh, not its own, that hides it from Tx or Rx; empty if none."""
        scatterers = self.scene.scatterers
        own = scatterers[number].name if number < len(scatterers) and scatterers[number].shade is not None else ""
        for end in (self.scene.agent.tx[place], self.scene.agent.rx[place]):
            last = point + CLEARANCE * (end - point)
            _, hit = crossings(end[None], last[None], self.triangles)
            names = [self.owner[t] for t in hit if self.owner[t] != own]
            if names:
                return names[0]
        return ""


PLACES = 15
"""Number of positions of a link budget, evenly along the trajectory; first, middle and last are its columns."""
DEPTHS = ((500, 2), (5000, 1))
"""Most triangles of a room, and the wall bounces that its link budget then counts; with more triangles direct paths
alone: the check is to take seconds. More bounces are seldom the strongest; they cover weaker paths."""
NOTHING_DB = -400.0
"""Margin [dB] over the detection threshold that stands for no path."""


class LandmarkLink(NamedTuple):
    """Link budget of one landmark under one kind of RIS codes, at K positions along the trajectory."""

    landmark: str
    """Name of the scatterer or RIS panel."""
    code: str
    """Kind of codes of a RIS panel, `aimed`, `swept` or `random`; empty for a scatterer."""
    margin_db: Floats
    """(K,) SNR of the landmark's strongest path over the detection threshold; of swept codes that of the best beam, of
    random ones that of the mean power."""
    probability: Floats
    """(K,) probability that the receiver reports at least one component of the landmark."""
    reason: tuple[str, ...]
    """(K,) why the landmark is not detected there; empty where it is."""

    @property
    def share(self) -> float:
        """Share of the trajectory on which a landmark is detected: the mean of its detection probability."""
        return float(np.mean(self.probability))

    @property
    def three(self) -> tuple[int, int, int]:
        """Indices of the first, the middle and the last position of a link budget."""
        last = len(self.margin_db) - 1
        return 0, last // 2, last


class Survey(NamedTuple):
    """Propagation paths of a room at positions along the trajectory, from which its link budget is worked out."""

    scene: Scene
    """The room, its trajectory cut to those positions."""
    paths: Paths
    settings: Settings
    depth: int
    """Most wall bounces of these paths."""


def survey(scene: Scene, settings: Settings, places: int = PLACES) -> Survey:
    """Find the paths at `places` positions along a scene's trajectory, by image sources, for its link budget."""
    rows = np.unique(np.linspace(0, len(scene.agent) - 1, places).round().astype(np.int64))
    scene = replace(scene, agent=scene.agent[rows])
    faces = sum(len(reflector.faces) for reflector in scene.reflectors)
    channel = ImageSourceChannel(scene, settings.radio, next((depth for most, depth in DEPTHS if faces <= most), 0))
    receiver = replace(settings.receiver, panels=max(len(scene.panels), 1))
    return Survey(scene, channel.paths(scene.agent), settings._replace(receiver=receiver), channel.depth)


def link_budget(looked: Survey, *, rng: np.random.Generator) -> list[LandmarkLink]:
    """Link budgets of scatterers, and of each RIS panel under each kind of codes (`rng` draws the random ones)."""
    scene, paths, settings = looked.scene, looked.paths, looked.settings
    meshes = [(r.name, r.triangles) for r in scene.reflectors] + [(o.name, o.triangles) for o in scene.occluders]
    meshes += [(s.name, s.shade.triangles) for s in scene.scatterers if s.shade is not None]
    owner = tuple(name for name, triangles in meshes for _ in range(len(triangles)))
    reasons = Reasons(scene, paths, settings, np.concatenate([triangles for _, triangles in meshes]), owner)
    if scene.ris is None:
        return [_link(name, "", [_all_places(paths, looked)], reasons, n) for n, name in enumerate(scene.landmarks)]
    links: list[LandmarkLink] = []
    spec = scene.ris.spec
    for kind, codes in codes_of(paths, spec, settings.radio, rng=rng).items():
        heard = [_all_places(rephase(paths, RisCode(levels, spec.levels)), looked) for levels in codes]
        if kind == "aimed":
            links += [_link(s.name, "", heard, reasons, n) for n, s in enumerate(scene.scatterers)]
        links += [
            _link(panel.name, kind, heard, reasons, len(scene.scatterers) + number)
            for number, panel in enumerate(scene.panels)
        ]
    return links


def _all_places(paths: Paths, looked: Survey) -> list[DetectionForecast]:
    """Link budget of a way: detection forecast of all landmarks under one RIS code, at each of its positions."""
    heading = looked.scene.agent.heading
    places = range(paths.num_cycles)
    return [forecast_detection(paths, place, float(heading[place]), looked.settings) for place in places]


def _link(name: str, code: str, heard: list[list[DetectionForecast]], reasons: Reasons, number: int) -> LandmarkLink:
    """Link budget of a landmark over C RIS codes: mean probability and SNR, but the best beam's of swept ones."""
    snr = np.array([[place.snr[number] for place in places] for places in heard])
    chance = np.array([[place.probability[number] for place in places] for places in heard]).mean(axis=0)
    level = snr.max(axis=0) if code == "swept" else snr.mean(axis=0)
    margin = 10.0 * np.log10(np.maximum(level / reasons.settings.sensor.threshold, 10.0 ** (NOTHING_DB / 10.0)))
    covered = np.array([place.covered[number] for place in heard[0]])
    said = tuple(
        "" if chance[place] > 0.5 else reasons.why(number, place, float(margin[place]), int(covered[place]))
        for place in range(len(margin))
    )
    return LandmarkLink(name, code, margin, chance, said)
