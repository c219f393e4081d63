"""Planes fitted to a scanned mesh in the order of their area; the noise is estimated from the mesh itself."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.triangles import connected
from rislam_rt.scene.importing.scans.point_cloud import PointCloud

LEAN = np.cos(np.radians(30.0))
"""Least cosine of the angle between a scanned point's normal and that of the plane it belongs to."""
ALIKE = np.cos(np.radians(1.0))
"""Least cosine of the angle between two parts of one scanned wall."""
LEAST_AREA = 0.3
"""Least area [m^2] of a scanned plane; smaller ones are clutter."""
GAP = 0.3
"""Width [m] of a scan's holes up to which they part no plane."""
NARROWEST = 0.25
"""Least width [m] of a scanned plane; narrower ones are strips of something round, or clutter."""
ROUND = 1.3
"""Residual over noise above which a scanned surface is not flat."""
WIDTHS = 3.0
"""Standard deviations of the scan's noise within which a point belongs to a plane."""
MAX_PLANES = 60
"""Most planes that are fitted to a scan."""
_SEEDS, _SCORED = 200, 6000


class ScanPlane(NamedTuple):
    """Plane fitted to a scan, `normal . x = offset`, and the points that it explains."""

    normal: Floats
    offset: float
    members: Integers
    """Indices of its points in the cloud."""
    residual: float
    """Root mean square distance [m] of its points."""
    area: float
    """Area [m^2] that its points stand for."""
    width: float
    """Short side [m] of the rectangle with the same second moments."""


def find_planes(cloud: PointCloud) -> list[ScanPlane]:
    """Fit planes to the point cloud of a scan, the largest first.

    In every round planes through some patches are scored by the area that lies on them (RANSAC with the normals that
    the patches have: Schnabel, Wahl and Klein, Computer Graphics Forum 2007); the best is fitted to what it explains
    and hangs together, and that is taken out.
    """
    free = np.ones(len(cloud.points), dtype=np.bool_)
    found: list[ScanPlane] = []
    reach = WIDTHS * max(cloud.noise, 1e-3)
    while len(found) < MAX_PLANES:
        plane = _best_plane(cloud, free, reach)
        if plane is None:
            break
        free[plane.members] = False
        if plane.area >= LEAST_AREA and plane.residual <= ROUND * max(cloud.noise, 1e-3) and plane.width >= NARROWEST:
            found.append(plane)
    return sorted(found, key=lambda plane: -plane.area)


def _best_plane(cloud: PointCloud, free: Booleans, reach: float) -> ScanPlane | None:
    """Fit the plane that holds the most area among a scan's free points; None if that is too little."""
    rows = np.flatnonzero(free)
    if cloud.area[rows].sum() < LEAST_AREA:
        return None
    seeds = rows[np.linspace(0, len(rows) - 1, min(_SEEDS, len(rows))).astype(int)]
    looked = rows[:: max(1, len(rows) // _SCORED)]
    normal = cloud.normal[seeds]
    apart = np.abs(cloud.points[looked] @ normal.T - np.einsum("si,si->s", cloud.points[seeds], normal))
    alike = cloud.normal[looked] @ normal.T > LEAN
    score = cloud.area[looked] @ ((apart < 2.0 * reach) & alike)
    best = int(np.argmax(score))
    if score[best] * len(rows) / len(looked) < LEAST_AREA:
        return None
    plane, offset, members = normal[best], float(cloud.points[seeds[best]] @ normal[best]), seeds[best : best + 1]
    for width in (3.0 * reach, 1.5 * reach, reach, reach):
        height = cloud.points[rows] @ plane - offset
        on = rows[(np.abs(height) < width) & (cloud.normal[rows] @ plane > LEAN)]
        if len(on) < 4:
            break
        groups = _connected_groups(cloud, on)
        members = groups[0]
        plane, offset = _fit(cloud.points[members], cloud.area[members], plane)
    else:
        members = np.concatenate([members, *(g for g in groups[1:] if _fits(cloud, g, plane, offset))])
    height = cloud.points[members] @ plane - offset
    weight = cloud.area[members]
    residual = float(np.sqrt((weight * height**2).sum() / max(weight.sum(), 1e-12)))
    local = cloud.points[members] - weight @ cloud.points[members] / max(weight.sum(), 1e-12)
    spread = np.linalg.eigvalsh(np.einsum("n,ni,nj->ij", weight, local, local) / max(weight.sum(), 1e-12))
    return ScanPlane(plane, offset, members, residual, float(weight.sum()), float(np.sqrt(12.0 * max(spread[1], 0.0))))


def _connected_groups(cloud: PointCloud, rows: Integers) -> list[Integers]:
    """Groups of a scan's points connected over gaps of `GAP`: the largest, then those of `LEAST_AREA` or more."""
    cells, box = np.unique(np.floor(cloud.points[rows] / (0.5 * GAP)).astype(np.int64), axis=0, return_inverse=True)
    near = cKDTree(cells).query_pairs(1.8, output_type="ndarray")
    label = connected(near, len(cells))[box.ravel()]
    size = np.bincount(label, cloud.area[rows])
    order = np.argsort(-size, kind="stable")
    return [rows[label == k] for k in order if size[k] >= LEAST_AREA or k == order[0]]


def _fits(cloud: PointCloud, rows: Integers, plane: Floats, offset: float) -> bool:
    """Whether further scanned points lie on a fitted plane too, with no lean or step of their own."""
    height = cloud.points[rows] @ plane - offset
    own, _ = _fit(cloud.points[rows], cloud.area[rows], plane)
    noise = max(cloud.noise, 1e-3)
    return bool(abs(height.mean()) < 0.5 * noise and height.std() < 1.1 * noise and own @ plane > ALIKE)


def _fit(points: Floats, weight: Floats, side: Floats) -> tuple[Floats, float]:
    """Fit of a scanned plane to points (N, 3) by weighted least squares: normal, on the side of `side`, and offset."""
    middle = weight @ points / weight.sum()
    local = points - middle
    normal = np.linalg.eigh(np.einsum("n,ni,nj->ij", weight, local, local))[1][:, 0]
    normal = normal * (1.0 if normal @ side >= 0.0 else -1.0)
    return normal, float(normal @ middle)
