"""Polygons in a plane: outlines of triangles, simplified to fewer corners, and triangulated."""

from collections import Counter

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers


def outline_loops(faces: Integers) -> list[list[int]]:
    """Closed loops of corners that outline triangles (T, 3), turned like them; around holes the other way.

    Sheets that lie on each other have each its outline, also where the outlines share edges; alike ones have one.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = Counter((int(a), int(b)) for a, b in edges)
    follow: dict[int, list[int]] = {}
    for a, b in sorted(there):
        follow.setdefault(a, []).extend([b] * max(there[a, b] - there[b, a], 0))
    follow = {a: ways for a, ways in follow.items() if ways}
    loops = []
    while follow:
        start = next(iter(follow))
        loop, here = [start], start
        while True:
            ways = follow.get(here)
            if not ways:
                break
            after = ways.pop()
            if not ways:
                del follow[here]
            if after == start:
                loops.append(loop)
                break
            if after in loop:  # a corner where the outline touches itself: the part between is a loop of its own
                cut = loop.index(after)
                loops.append(loop[cut:])
                loop = loop[:cut]
            loop.append(after)
            here = after
    return list({frozenset(loop): loop for loop in loops if len(loop) > 2}.values())


def signed_area(corners: Floats) -> float:
    """Area of a polygon (n, 2), positive if it runs counter-clockwise."""
    x, y = (corners - corners[0]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def inside_loop(corners: Floats, points: Floats) -> Booleans:
    """Whether (...,) points (..., 2) lie inside a polygon (n, 2): a ray along x crosses it an odd number of times."""
    a, b = corners, np.roll(corners, -1, axis=0)
    y = points[..., None, 1]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    at = a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
    return np.asarray(np.sum(spans & (points[..., None, 0] < at), axis=-1) % 2 == 1)


def simplify_loop(loop: list[int], points: Floats, kept: Booleans, tolerance: float) -> list[int]:
    """Simplify a closed polygon to the corners that are `kept` (V,), and as few others as keep it within a tolerance.

    The chain between two kept corners is simplified from its lower-numbered end, so that the two facets that it parts
    agree on it. Douglas and Peucker, Cartographica 1973.
    """
    anchors = [i for i, corner in enumerate(loop) if kept[corner]]
    if len(anchors) < 2:
        first = anchors[0] if anchors else int(np.argmin(loop))
        loop = loop[first:] + loop[:first]
        far = int(np.argmax(np.linalg.norm(points[loop] - points[loop[0]], axis=1)))
        anchors = [0, far]
    thinned: list[int] = []
    for begin, end in zip(anchors, [*anchors[1:], anchors[0] + len(loop)], strict=True):
        chain = [loop[i % len(loop)] for i in range(begin, end + 1)]
        turned = chain[0] > chain[-1]
        chain = _simplify_chain(chain[::-1] if turned else chain, points, tolerance)
        thinned += (chain[::-1] if turned else chain)[:-1]
    return thinned


def _simplify_chain(chain: list[int], points: Floats, tolerance: float) -> list[int]:
    """Simplify an open chain of a polygon's corners within a tolerance by Douglas and Peucker; its ends stay."""
    keep, stack = {0, len(chain) - 1}, [(0, len(chain) - 1)]
    while stack:
        low, high = stack.pop()
        if high - low < 2:
            continue
        distance = _off_segment(points[chain[low + 1 : high]], points[chain[low]], points[chain[high]])
        worst = int(np.argmax(distance))
        if distance[worst] > tolerance:
            middle = low + 1 + worst
            keep.add(middle)
            stack += [(low, middle), (middle, high)]
    return [chain[i] for i in sorted(keep)]


def _off_segment(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance (n,) of a polygon's corners (n, 3) from a segment."""
    along = end - start
    square = float(along @ along)
    fraction = np.clip((points - start) @ along / square, 0.0, 1.0) if square else np.zeros(len(points))
    return np.linalg.norm(points - start - fraction[:, None] * along, axis=1)


def triangulate(outer: Floats, holes: list[Floats]) -> Integers | None:
    """Triangulate a polygon (n, 2) that runs counter-clockwise, with holes that run clockwise: corner numbers (T, 3).

    Numbers count through the outer loop, then the holes in their order. Ears are clipped off (Meisters, Am. Math.
    Monthly 1975), holes joined by a bridge before. None where the polygon crosses itself.
    """
    points = np.concatenate([outer, *holes])
    ring = list(range(len(outer)))
    starts = np.cumsum([len(outer), *(len(hole) for hole in holes)])
    rings = [list(range(starts[k], starts[k] + len(hole))) for k, hole in enumerate(holes)]
    for hole in sorted(rings, key=lambda r: -points[r, 0].max()):
        joined = _bridged(ring, hole, points, [r for r in rings if r is not hole])
        if joined is None:
            return None
        ring = joined
    found = _clip_ears(ring, points)
    if found is None:
        return None
    triangles = np.array(found, dtype=np.int64).reshape(-1, 3)
    wanted = signed_area(outer) + sum(signed_area(hole) for hole in holes)
    a, b, c = points[triangles].swapaxes(0, 1)
    got = 0.5 * float(np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum())
    return triangles if len(triangles) and abs(got - wanted) <= 1e-6 * abs(wanted) else None


def _bridged(ring: list[int], hole: list[int], points: Floats, others: list[list[int]]) -> list[int] | None:
    """Join a hole to a polygon's outline by the shortest bridge from its rightmost corner; None if all cross."""
    tip = max(range(len(hole)), key=lambda i: points[hole[i], 0])
    start = points[hole[tip]]
    loops = [ring, hole, *others]
    heads = np.concatenate([points[loop] for loop in loops])
    tails = np.concatenate([np.roll(points[loop], -1, axis=0) for loop in loops])
    for i in np.argsort(np.linalg.norm(points[ring] - start, axis=1), kind="stable"):
        end = points[ring[i]]
        if not _crosses_any(start, end, heads, tails) and _opens_to(ring, int(i), points, start):
            turned = hole[tip:] + hole[: tip + 1]
            return [*ring[: i + 1], *turned, *ring[i:]]
    return None


def _opens_to(ring: list[int], i: int, points: Floats, target: Floats) -> bool:
    """Whether a target lies on the inner side of a polygon at one of its corners."""
    before, here, after = (points[ring[(i + k) % len(ring)]] for k in (-1, 0, 1))
    left, right = _turn(before, here, target) >= 0.0, _turn(here, after, target) >= 0.0
    convex = _turn(before, here, after) >= 0.0
    return bool((left and right) if convex else (left or right))


def _crosses_any(start: Floats, end: Floats, heads: Floats, tails: Floats) -> bool:
    """Whether a polygon's segment crosses any of several others, other than at its ends."""
    a, b = _turn(heads, tails, start), _turn(heads, tails, end)
    c, d = _turn(start, end, heads), _turn(start, end, tails)
    small = 1e-12 * float(np.abs(heads).max(initial=1.0)) ** 2
    return bool(((a * b < 0.0) & (c * d < 0.0) & (np.minimum(np.abs(a), np.abs(b)) > small)
                 & (np.minimum(np.abs(c), np.abs(d)) > small)).any())  # fmt: skip


def _turn(a: Floats, b: Floats, c: Floats) -> Floats:
    """Twice the signed area of triangles (a, b, c) of polygons in a plane, positive if they run counter-clockwise."""
    return np.asarray((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0])


def _clip_ears(ring: list[int], points: Floats) -> list[tuple[int, int, int]] | None:
    """Triangulate a polygon without holes by clipping ears; None where none can be clipped off."""
    ring, found = list(ring), []
    size = float(np.ptp(points, axis=0).max())
    flat = 1e-12 * size * size
    at, idle = 0, 0
    while len(ring) > 3:
        if idle > len(ring):
            return None
        i, j, k = ring[at % len(ring) - 1], ring[at % len(ring)], ring[(at + 1) % len(ring)]
        turn = float(_turn(points[i], points[j], points[k]))
        if abs(turn) <= flat or (turn > 0.0 and _is_empty((i, j, k), ring, points, flat)):
            if abs(turn) > flat:
                found.append((i, j, k))
            ring.pop(at % len(ring))
            idle, at = 0, at % max(len(ring), 1)
        else:
            at, idle = at + 1, idle + 1
    if float(_turn(*points[ring])) > flat:
        found.append((ring[0], ring[1], ring[2]))
    return found


def _is_empty(ear: tuple[int, int, int], ring: list[int], points: Floats, flat: float) -> bool:
    """Whether no other corner of a polygon lies in an ear; copies of its own corners (bridges) do not count."""
    a, b, c = points[list(ear)]
    rest = points[ring]
    inside = (_turn(a, b, rest) > -flat) & (_turn(b, c, rest) > -flat) & (_turn(c, a, rest) > -flat)
    own = (rest == a).all(axis=1) | (rest == b).all(axis=1) | (rest == c).all(axis=1)
    return not bool((inside & ~own).any())
