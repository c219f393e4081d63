"""Export of a traced scene as a scenario of DeepMIMO v4, written without its package.

Each quantity is one `.npz` file for a pair of Tx and Rx sets, receivers by
paths, the strongest first, filled up with NaN; `params.json` describes radio, sets and materials; the room is a
triangular mesh. A moving agent is a dynamic scenario: one folder of such files a cycle.
"""

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.model import Material, PathKind, Paths, RadioConfig, Scene
from rislam_rt.model.itu import itu_parameters
from rislam_rt.storage.files import json_file

FORMAT_VERSION = "4.0.5"
"""Version of the DeepMIMO package whose readers these files are made for."""
REFLECTION, SCATTERING = 1, 3
"""DeepMIMO's interaction codes: those of a path are the digits of one number, from the Tx on; a line of sight is 0."""
NO_DIFFUSE = ("diffuse_reflections", "diffuse_diffractions", "diffuse_transmissions")
NO_FLAGS = (
    "diffuse_final_interaction_only", "diffuse_random_phases", "terrain_reflection", "terrain_diffraction",
    "terrain_scattering",
)  # fmt: skip
NO_SCATTERING = ("cross_polarization_coefficient", "roughness", "vertical_attenuation", "horizontal_attenuation")
"""Settings that the format wants and that have no meaning here: paths are specular or run over a point."""
METAL = 1e7
"""[S/m] Conductivity of a metal in ITU-R P.2040."""


def deepmimo_files(scene: Scene, paths: Paths, radio: RadioConfig, depth: int) -> dict[str, bytes]:
    """Files of a DeepMIMO scenario by name, from a scene and the paths along its trajectory.

    Power is the path gain [dB], phase [deg] holds the carrier's, so that the sum over paths is the channel at the
    carrier; angles [deg] are azimuth and zenith angle in the world's frame. The panel is at the level of `paths`.

    Parameters
    ----------
    scene
        Whose trajectory the paths were found along.
    depth
        Largest number of wall bounces that was looked for.
    """
    room = _room_files(scene)
    cycles = paths.num_cycles
    files: dict[str, bytes] = {"params.json": json_file(_parameters(scene, paths, radio, depth))}
    for cycle in range(cycles):
        folder = "" if cycles == 1 else f"scene_{cycle:05d}/"
        values = cycle_matrices(paths, cycle)
        values |= {"tx_pos": scene.agent.tx[cycle][None], "rx_pos": scene.agent.rx[cycle][None]}
        files |= {f"{folder}{name}_t000_tx000_r001.npz": _npz({name: value}) for name, value in values.items()}
        files |= {f"{folder}{name}": content for name, content in room.items()}
    return files


def check_name(name: str) -> None:
    """Check the folder name of a DeepMIMO scenario: its package finds lower-case names alone.

    Raises
    ------
    ConfigError
        The name has upper case or special characters.
    """
    if name != name.lower() or set(name) & set("/\\:*?\"'<>|\n"):
        raise ConfigError(f"--deepmimo: '{name[:60]}' is a name that deepmimo cannot load; use lower case and no marks")


def cycle_matrices(paths: Paths, cycle: int) -> dict[str, Floats]:
    """DeepMIMO's path matrices of one cycle, (1, P) each and (1, P, V, 3) for the points, strongest path first."""
    found = np.flatnonzero(paths.valid[cycle])
    found = found[np.argsort(-np.abs(paths.gain[cycle, found]), kind="stable")]
    gain = paths.gain[cycle, found]
    (theta_t, phi_t), (theta_r, phi_r) = (
        (angle[cycle, found] for angle in angles) for angles in (paths.aod, paths.aoa)
    )
    count = paths.num_vertices[found]
    longest = int(count.max(initial=1))
    points = np.array(paths.vertices[cycle, found, :longest])
    points[np.arange(points.shape[1]) >= count[:, None]] = np.nan
    values = {
        "power": 20.0 * np.log10(np.abs(gain)), "phase": np.rad2deg(np.angle(gain)), "delay": paths.tau[cycle, found],
        "aod_az": np.rad2deg(phi_t), "aod_el": np.rad2deg(theta_t), "aoa_az": np.rad2deg(phi_r),
        "aoa_el": np.rad2deg(theta_r),
        "inter": np.array([_interactions(paths, int(path)) for path in found], dtype=np.float64), "inter_pos": points,
    }  # fmt: skip
    return {name: value[None] for name, value in values.items()}


def _interactions(paths: Paths, path: int) -> int:
    """DeepMIMO's interaction number of a path: digits for reflections at walls, scattering at a landmark or panel."""
    kind, _, tx, rx = paths.identity(path)
    middle = [] if kind in (PathKind.LOS, PathKind.VT) else [SCATTERING]
    digits = len(tx) * [REFLECTION] + middle + len(rx) * [REFLECTION]
    return int("".join(map(str, digits)) or "0")


def _parameters(scene: Scene, paths: Paths, radio: RadioConfig, depth: int) -> dict[str, Any]:
    """Content of DeepMIMO's `params.json`: tracer, scene, materials, Tx and Rx."""
    from rislam_rt import __version__

    faces = sum(len(one.faces) for one in scene.reflectors)
    return {
        "version": FORMAT_VERSION,
        "rt_params": {
            "raytracer_name": f"rislam_rt ({paths.source})", "raytracer_version": __version__,
            "frequency": radio.carrier, "max_path_depth": depth + 1, "max_reflections": depth, "max_diffractions": 0,
            "max_scattering": 1, "max_transmissions": 0, **dict.fromkeys(NO_DIFFUSE, 0),
            **dict.fromkeys(NO_FLAGS, False), "num_rays": 0, "ray_casting_method": "none",
            "ray_casting_range_az": 360.0, "ray_casting_range_el": 180.0, "gps_bbox": [0.0, 0.0, 0.0, 0.0],
            "synthetic_array": True,
            "raw_params": {
                "scene": scene.name, "time_s": scene.agent.time.tolist(), "landmarks": list(paths.landmarks),
            },
        },
        "txrx_sets": {
            f"txrx_set_{number}": {
                "name": name, "id_orig": number, "id": number, "is_tx": name == "tx", "is_rx": name == "rx",
                "num_points": 1, "num_active_points": 1, "num_ant": 1, "dual_pol": False,
                "ant_rel_positions": [[0, 0, 0]], "array_orientation": [0, 0, 0],
            }
            for number, name in enumerate(("tx", "rx"))
        },
        "materials": {f"material_{n}": one for n, one in enumerate(_materials(scene, radio))},
        "scene": {
            "num_scenes": paths.num_cycles, "n_objects": len(scene.reflectors),
            "n_vertices": sum(len(one.vertices) for one in scene.reflectors), "n_faces": faces,
            "n_triangular_faces": faces, "representation": "mesh",
        },
    }  # fmt: skip


def _distinct(scene: Scene) -> list[Material]:
    """Materials of a scene's reflectors, each once, for DeepMIMO."""
    return list(dict.fromkeys(one.material for one in scene.reflectors))


def _materials(scene: Scene, radio: RadioConfig) -> list[dict[str, Any]]:
    """DeepMIMO's entries of a scene's materials."""
    return [
        {"id": number, "name": one.words, "thickness": one.thickness}
        | dict.fromkeys(NO_SCATTERING, 0.0)
        | {"scattering_model": "lambertian" if one.scattering else "none", "scattering_coefficient": one.scattering}
        | _electric(one, radio.carrier)
        for number, one in enumerate(_distinct(scene))
    ]


def _electric(material: Material, carrier: float) -> dict[str, float]:
    """Permittivity and conductivity [S/m] at the carrier [Hz] for DeepMIMO; of a constant R, its half-space's."""
    if material.itu is not None:
        a, b, c, d = itu_parameters(material.itu, carrier)
        ghz = carrier / 1e9
        constants = {"itu_a": a, "itu_b": b, "itu_c": c, "itu_d": d}
        return {"permittivity": a * ghz**b, "conductivity": c * ghz**d, **constants}
    if material.reflection is None:
        return {"permittivity": float(material.permittivity or 1.0), "conductivity": material.conductivity}
    if material.reflection == 1.0:
        return {"permittivity": 1.0, "conductivity": METAL}
    index = (1.0 + material.reflection) / (1.0 - material.reflection)
    return {"permittivity": index**2, "conductivity": 0.0}


def _room_files(scene: Scene) -> dict[str, bytes]:
    """DeepMIMO's files of the room: vertices of all reflectors, with faces and materials of each."""
    materials = _distinct(scene)
    first = np.cumsum([0, *(len(one.vertices) for one in scene.reflectors)])
    faces = {str(number): one.faces + first[number] for number, one in enumerate(scene.reflectors)}
    kinds = {str(n): np.full(len(one.faces), materials.index(one.material)) for n, one in enumerate(scene.reflectors)}
    objects = [
        {"name": one.name, "label": "objects", "id": number, "mesh_key": str(number)}
        for number, one in enumerate(scene.reflectors)
    ]
    pool = np.concatenate([one.vertices for one in scene.reflectors]) if scene.reflectors else np.zeros((0, 3))
    return {
        "vertices.npz": _npz({"vertices": pool}),
        "faces.npz": _npz(faces),
        "materials.npz": _npz(kinds),
        "objects.json": json_file(objects),
    }


def _npz(arrays: Mapping[str, Any]) -> bytes:
    """Encode arrays as the content of a compressed `.npz` file of DeepMIMO."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()
