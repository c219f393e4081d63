"""The RIS candidate, where the panel may hang while no landmark is held for it: tracks weighed as landmarks are.

A track is taken for the point that its delay and direction tell. What its amplitudes say under the codes applied, and
the cycles in which it was silent, is counted as in `identity`; the design then aims at whatever may yet be the panel.
"""

import numpy as np

from rislam_rt.information import amplitude_std
from rislam_rt.model import Body, PanelCandidate, RisCode
from rislam_rt.ris.path_gain import panel_path_gain
from rislam_rt.slam.identity import add_evidence, log_panel, log_panel_missed, log_scatterer, log_scatterer_missed
from rislam_rt.slam.moments import even_draws, poses_of
from rislam_rt.slam.nested.belief_moments import Moments
from rislam_rt.slam.nested.landmark_table import LandmarkTable
from rislam_rt.slam.nested.landmark_update import TOLD
from rislam_rt.slam.nested.measurement_prediction import MapBelief
from rislam_rt.slam.nested.mirrors import is_behind_mirror, mirror_images
from rislam_rt.slam.nested.tracks import LandmarkTracks
from rislam_rt.slam.observations import PANEL, UNTOLD
from rislam_rt.slam.ris_candidate import DEEP, DISMISSAL, PATIENCE, places

DRAWS = 12
"""Places of a track over which the panel's predicted gain is averaged."""


def weigh_tracks(tracks: LandmarkTracks, belief: MapBelief, code: RisCode | None) -> LandmarkTracks:
    """Tracks of the nested filter weighed as RIS candidates by this cycle: is each one of the panels?"""
    rows = np.flatnonzero(~tracks.specular)
    if belief.ris is None or code is None or not len(rows):
        return tracks
    radio = belief.radio
    spread = np.sqrt(tracks.covariance[rows][..., 0, 0])
    looks = tracks.mean[rows, None, :, 0] + even_draws(DRAWS, 3) * spread[:, None]
    center, _ = places(looks, belief.poses)
    _, rx_length = places(tracks.mean[rows, :, 0], belief.poses)
    tx_length = np.maximum(tracks.mean[rows, 0, 0] - rx_length, 1e-3)
    std = np.full(len(rows), amplitude_std(radio))
    threshold = belief.threshold
    here = tracks.misses[rows] == 0
    amplitude = np.exp(tracks.log_amplitude[rows])
    panel, side = np.empty((len(rows), len(belief.ris.panels))), tracks.side[rows]
    for number, (sheet, part) in enumerate(zip(belief.ris.panels, belief.ris.parts(code), strict=True)):
        gain = panel_path_gain(sheet, part, center, belief.poses.tx, belief.poses.rx, np.ones(1), radio)
        panel[:, number] = np.where(here, log_panel(amplitude, std, gain), log_panel_missed(std, gain, threshold))
        panel[here & (side != UNTOLD) & (side != PANEL + number), number] = -np.inf
    scatterer = np.where(
        here[:, None],
        log_scatterer(amplitude, std, tx_length, rx_length, radio),
        log_scatterer_missed(std, tx_length, rx_length, radio, threshold),
    )
    log_grid, log_ris = tracks.log_grid.copy(), tracks.log_ris.copy()
    log_grid[rows], log_ris[rows] = add_evidence(log_grid[rows], log_ris[rows], scatterer, panel)
    log_ris[rows] += np.where(here[:, None] & (side[:, None] == PANEL + np.arange(panel.shape[1])), TOLD, 0.0)
    return tracks._replace(log_grid=log_grid, log_ris=log_ris)


def find_panel_candidate(
    tracks: LandmarkTracks, table: LandmarkTable, moments: Moments, body: Body, panel: int = 0
) -> PanelCandidate | None:
    """The nested filter's RIS candidate: landmark or track likeliest a panel; None if nothing is likelier so than not.

    A track that seems to come from behind a mirror may be the panel over walls: aiming there would miss it.
    """
    points = table.points[~np.isin(table.points, table.holders)]  # what is another panel is not this one
    poses = poses_of(moments.position, np.asarray(moments.heading), body)
    least = np.where(tracks.length > 1, DISMISSAL, 0.0)
    alive = tracks.misses <= np.minimum(tracks.length - 1, PATIENCE)
    rows = np.flatnonzero(~tracks.specular & alive & (tracks.log_ris[:, panel] > least))
    if len(rows):
        mirrored = mirror_images(tracks, moments, table, body)
        spots = places(tracks.mean[rows, :, 0], poses)[0]
        seen = [not is_behind_mirror(spot, moments.position, mirrored, DEEP) for spot in spots]
        rows, spots = rows[seen], spots[seen]
    odds = np.concatenate([table.log_ris[points, panel], tracks.log_ris[rows, panel]])
    if not len(odds) or odds.max() <= DISMISSAL:
        return None
    best = int(np.argmax(odds))
    if best < len(points):
        return PanelCandidate(moments.features[points[best]], int(table.hits[points[best]]), panel)
    return PanelCandidate(spots[best - len(points)], int(tracks.length[rows[best - len(points)]]), panel)
