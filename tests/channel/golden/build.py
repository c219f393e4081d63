"""Write the golden files: `python tests/channel/golden/build.py [ROOM ...]`, after a change meant to change paths.

One NetCDF file a room: two poses and every path of theirs from the image-source channel, panel at level 0.
"""

import sys
from pathlib import Path

import h5netcdf
import h5py
import numpy as np

from rislam_rt.channel.compare import random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import Body, RadioConfig, Trajectory
from rislam_rt.scene import load_scene

FOLDER = Path(__file__).parent
SCENES = FOLDER.parents[2] / "scenes"
DEPTH = {"large_hall": 1}
"""Bounces, where not 2."""


def golden_paths(paths):
    """Every valid (cycle, path) as one record, sorted by cycle and label."""
    cycle, column = np.nonzero(paths.valid)
    label = np.array([paths.label(p) for p in column])
    order = np.lexsort((label, cycle))
    place = cycle[order], column[order]
    return {
        "cycle": place[0],
        "label": label[order],
        "tau": paths.tau[place],
        "departure": paths.departure[place],
        "arrival": paths.arrival[place],
        "gain_re": paths.gain[place].real,
        "gain_im": paths.gain[place].imag,
    }


UNITS = {"tau": "s", "position": "m", "heading": "rad", "tx_offset": "m", "rx_offset": "m"}


def write(file, trajectory, depth, records):
    """One golden file."""
    with h5netcdf.File(file, "w") as data:
        data.dimensions = {"pose": len(trajectory), "path": len(records["cycle"]), "xyz": 3}
        data.attrs["depth"] = depth
        poses = {
            "position": (("pose", "xyz"), trajectory.position),
            "heading": (("pose",), trajectory.heading),
            "tx_offset": (("xyz",), trajectory.body.tx_offset),
            "rx_offset": (("xyz",), trajectory.body.rx_offset),
        }
        shapes = {name: (("path", "xyz") if np.ndim(v) == 2 else ("path",), v) for name, v in records.items()}
        for name, (dimensions, values) in {**poses, **shapes}.items():
            values = np.asarray(values)
            text = values.dtype.kind == "U"
            kind = h5py.string_dtype() if text else values.dtype
            values = values.astype(object) if text else values
            variable = data.create_variable(name, dimensions, kind, data=values, compression="gzip", shuffle=not text)
            if name in UNITS:
                variable.attrs["units"] = UNITS[name]


def read(file):
    """Trajectory, depth and records of a golden file."""
    with h5netcdf.File(file, "r", decode_vlen_strings=True) as data:
        values = {name: np.array(variable[...]) for name, variable in data.variables.items()}
        depth = int(data.attrs["depth"])
    position = values.pop("position")
    body = Body(values.pop("tx_offset"), values.pop("rx_offset"))
    count = len(position)
    heading = values.pop("heading")
    trajectory = Trajectory(np.arange(float(count)), position, np.zeros((count, 3)), heading, body)
    return trajectory, depth, values


def main():
    for folder in sorted(path.parent for path in SCENES.glob("*/scene.toml")):
        if sys.argv[1:] and folder.name not in sys.argv[1:]:
            continue
        scene = load_scene(folder)
        depth = DEPTH.get(folder.name, 2)
        trajectory = random_poses(scene, 2, rng=np.random.default_rng(11))
        paths = ImageSourceChannel(scene, RadioConfig(), depth).paths(trajectory)
        write(FOLDER / f"{folder.name}.nc", trajectory, depth, golden_paths(paths))


if __name__ == "__main__":
    main()
