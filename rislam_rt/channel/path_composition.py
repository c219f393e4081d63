"""Composition of paths from specular legs: LOS and VT are one leg; PS, VS, RIS and VRIS join a Tx leg and an Rx leg at
a landmark."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.channel.cross_section import cross_section
from rislam_rt.channel.specular_legs import NO_WALL, SpecularLegs, turned_round
from rislam_rt.channel.walls import Walls
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import PathKind, Paths, RadioConfig, RisLegs, Scene
from rislam_rt.ris import leg_response, rephase, zero_code


def compose_paths(
    scene: Scene, radio: RadioConfig, walls: Walls, depth: int, direct: SpecularLegs, tx_legs: Sequence[SpecularLegs],
    rx_legs: Sequence[SpecularLegs], source: str,
) -> Paths:  # fmt: skip
    """Compose specular legs to all paths of up to `depth` wall bounces, with gains, that some cycle has.

    Parameters
    ----------
    direct
        Legs from the Tx (device) to the Rx (far end): LOS and VT.
    tx_legs, rx_legs
        For each landmark in the order of `scene.landmarks`, the legs from the Tx, and from the Rx, to it.
    source
        How the legs were found, kept in the result.
    """
    blocks = [_direct_block(direct, radio, depth)]
    responses: list[tuple[Complexes, Complexes]] = []
    for number, (tx, rx) in enumerate(zip(tx_legs, rx_legs, strict=True)):
        panel = scene.panel_number(number)
        block = _join_block(tx, rx, scene.landmark_positions[number], number, panel >= 0, depth)
        if panel >= 0:
            for name, before in zip(("tx_leg", "rx_leg"), zip(*responses, strict=True), strict=False):
                block[name] = block[name] + sum(legs.shape[1] for legs in before)
            responses.append(_panel_responses(scene, radio, panel, tx, rx))
        else:
            i, j = block["tx_leg"], block["rx_leg"]
            rcs = cross_section(scene.scatterers[number], radio.wavelength, tx.at_far_end[:, i], rx.at_far_end[:, j])
            join = np.sqrt(4.0 * np.pi * rcs) / radio.wavelength
            gain = tx.gain(radio.wavelength)[:, i] * rx.gain(radio.wavelength)[:, j]
            block["gain"] = gain * join * np.sqrt(radio.tx_gain * radio.rx_gain)
            block["tx_leg"] = np.full(len(block["kind"]), -1)
            block["rx_leg"] = np.full(len(block["kind"]), -1)
        blocks.append(block)
    merged = {
        name: np.concatenate([block[name] for block in blocks], axis=0 if name in _PER_PATH else 1)
        for name in blocks[0]
        if name not in ("tx_leg", "rx_leg")
    }
    keep: Booleans = np.logical_or.reduce(merged["valid"], axis=0)
    ris = None
    if responses:
        sides = [np.concatenate(legs, axis=1) if len(legs) > 1 else legs[0] for legs in zip(*responses, strict=True)]
        tx_leg, rx_leg = (np.concatenate([block[name] for block in blocks]) for name in ("tx_leg", "rx_leg"))
        assert scene.ris is not None
        spans = tuple(scene.ris.spec.span(number) for number in range(len(scene.panels)))
        ris = RisLegs(sides[0], sides[1], tx_leg[keep], rx_leg[keep], spans)
    fields: dict[str, Any] = {
        name: value[keep] if name in _PER_PATH else value[:, keep] for name, value in merged.items()
    }
    for name in ("tau", "departure", "arrival", "gain", "vertices"):
        mask = fields["valid"].reshape(fields["valid"].shape + (1,) * (fields[name].ndim - 2))
        fields[name] = np.where(mask, fields[name], 0.0)
    paths = Paths(
        **fields, walls=walls.names, landmarks=scene.landmarks, ris=ris, source=source,
        num_panels=max(len(scene.panels), 1),
    )  # fmt: skip
    return rephase(paths, zero_code(scene.ris.spec)) if scene.ris is not None else paths


_PER_PATH = ("kind", "landmark", "tx_walls", "rx_walls", "num_vertices", "tx_leg", "rx_leg")


def _direct_block(direct: SpecularLegs, radio: RadioConfig, depth: int) -> dict[str, Any]:
    """Fields of `Paths` for LOS and wall returns (VT), from the legs between Tx and Rx."""
    keep = np.flatnonzero(direct.num_bounces <= depth)
    bounces = direct.num_bounces[keep]
    paths = len(keep)
    return {
        "kind": np.where(bounces == 0, PathKind.LOS, PathKind.VT),
        "landmark": np.full(paths, -1),
        "tx_walls": _padded(direct.walls[keep], depth),
        "rx_walls": np.full((paths, depth), -1),
        "num_vertices": bounces,
        "tx_leg": np.full(paths, -1),
        "rx_leg": np.full(paths, -1),
        "valid": direct.valid[:, keep],
        "tau": direct.length[:, keep] / SPEED_OF_LIGHT,
        "departure": direct.at_device[:, keep],
        "arrival": direct.at_far_end[:, keep],
        "gain": direct.gain(radio.wavelength)[:, keep] * np.sqrt(radio.tx_gain * radio.rx_gain),
        "vertices": _padded(direct.vertices[:, keep], depth + 1, axis=2, fill=0.0),
    }


def _join_block(
    tx: SpecularLegs, rx: SpecularLegs, point: Floats, landmark: int, is_ris: bool, depth: int
) -> dict[str, Any]:
    """Fields of `Paths` over one landmark: every Tx leg with every Rx leg, up to `depth` bounces together; gain 0."""
    i, j = np.nonzero(tx.num_bounces[:, None] + rx.num_bounces[None, :] <= depth)
    ever = np.logical_or.reduce(tx.valid)[i] & np.logical_or.reduce(rx.valid)[j]
    i, j = i[ever], j[ever]
    bare = (tx.num_bounces[i] == 0) & (rx.num_bounces[j] == 0)
    plain, walled = (PathKind.RIS, PathKind.VRIS) if is_ris else (PathKind.PS, PathKind.VS)
    return {
        "kind": np.where(bare, plain, walled),
        "landmark": np.full(len(i), landmark),
        "tx_walls": _padded(tx.walls[i], depth),
        "rx_walls": _padded(turned_round(rx.walls)[j], depth),
        "num_vertices": tx.num_bounces[i] + rx.num_bounces[j] + 1,
        "tx_leg": i,
        "rx_leg": j,
        "valid": tx.valid[:, i] & rx.valid[:, j],
        "tau": (tx.length[:, i] + rx.length[:, j]) / SPEED_OF_LIGHT,
        "departure": tx.at_device[:, i],
        "arrival": rx.at_device[:, j],
        "gain": np.zeros((tx.valid.shape[0], len(i)), dtype=np.complex128),
        "vertices": _joined_vertices(tx, rx, i, j, point, depth + 1),
    }


def _panel_responses(
    scene: Scene, radio: RadioConfig, number: int, tx: SpecularLegs, rx: SpecularLegs
) -> tuple[Complexes, Complexes]:
    """Responses (K, I, N, M), (K, J, N, M) of a panel's elements to the Tx and Rx legs that compose its paths, by
    mirrored devices."""
    assert scene.ris is not None
    spec, center = scene.panels[number].spec, scene.panels[number].center
    responses = []
    for legs, antenna_gain in ((tx, radio.tx_gain), (rx, radio.rx_gain)):
        length = np.where(legs.valid, legs.length, 1.0)
        direction = np.where(legs.valid[..., None], legs.at_far_end, spec.normal)
        device = center + length[..., None] * direction
        coefficient = np.where(legs.valid, legs.coefficient, 0.0) * np.sqrt(antenna_gain)
        response = leg_response(spec, center, device, coefficient, radio.wavelength)
        responses.append(scene.ris.spec.place(number, response))
    return responses[0], responses[1]


def _padded(values: Any, count: int, axis: int = 1, fill: float = NO_WALL) -> Any:
    """Composition of paths: pad or cut the legs' wall sequences (P, d), or their vertices (K, S, D, 3), to exactly
    `count` bounces, which lie along an axis."""
    width = [(0, max(count - values.shape[n], 0) if n == axis else 0) for n in range(values.ndim)]
    return np.pad(values, width, constant_values=fill).take(np.arange(count), axis=axis)


def _joined_vertices(tx: SpecularLegs, rx: SpecularLegs, i: Integers, j: Integers, point: Floats, count: int) -> Floats:
    """Vertices (K, P, count, 3) [m] of paths composed of two legs, in the order of travel over the landmark."""
    vertices = np.zeros((tx.valid.shape[0], len(i), count, 3))
    for path, (a, b) in enumerate(zip(i, j, strict=True)):
        first, last = int(tx.num_bounces[a]), int(rx.num_bounces[b])
        vertices[:, path, :first] = tx.vertices[:, a, :first]
        vertices[:, path, first] = point
        vertices[:, path, first + 1 : first + 1 + last] = rx.vertices[:, b, :last][:, ::-1]
    return vertices
