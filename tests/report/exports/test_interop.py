"""Our files in other people's programs: `make interop` runs these, for the lock file holds neither package."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import PathKind, RadioConfig
from rislam_rt.report.exports.deepmimo import deepmimo_files
from rislam_rt.report.exports.rerun_recording import recording_bytes
from rislam_rt.scene import load_scene
from rislam_rt.scene.write import write_files

ROOT = Path(__file__).parents[3]
pytestmark = [pytest.mark.interop, pytest.mark.filterwarnings("default")]


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    import deepmimo

    scene = load_scene(ROOT / "scenes" / "paper_room")
    scene = replace(scene, agent=scene.agent[:600:200])
    paths = ImageSourceChannel(scene, RadioConfig(), 2).paths(scene.agent)
    folder = tmp_path_factory.mktemp("scenarios")
    write_files(deepmimo_files(scene, paths, RadioConfig(), 2), folder / "paper_room")
    deepmimo.config.set("scenarios_folder", str(folder))
    return scene, paths, deepmimo.load("paper_room", max_paths=500)


def test_deepmimo_reads_every_path(scenario):
    scene, paths, found = scenario
    assert found.n_scenes == 3
    for cycle, one in enumerate(found.datasets):
        here = paths.valid[cycle]
        assert int(one.num_paths[0]) == here.sum()
        np.testing.assert_allclose(np.sort(one.delay[0]), np.sort(paths.tau[cycle, here]), rtol=1e-12)
        np.testing.assert_allclose(np.ravel(one.tx_pos), scene.agent.tx[cycle])
        np.testing.assert_allclose(np.ravel(one.rx_pos), scene.agent.rx[cycle])
        assert int(one.los[0]) == 1
        walls = [word for word in one.inter_str[0] if set(str(word)) == {"R"}]
        assert len(walls) == np.sum(here & (paths.kind == PathKind.VT))


def test_the_channel_that_deepmimo_computes_is_ours(scenario):
    import deepmimo

    _, paths, found = scenario
    radio = {"subcarriers": 64, "selected_subcarriers": list(range(64)), "bandwidth": 200e6}
    wanted = deepmimo.ChannelParameters(bs_antenna={"shape": [1, 1]}, num_paths=500, ofdm=radio)
    for cycle, one in enumerate(found.datasets):
        here = paths.valid[cycle]
        offset = np.arange(64) * 200e6 / 64
        turn = np.exp(-2j * np.pi * offset[:, None] * paths.tau[cycle, here])
        ours = turn @ paths.gain[cycle, here]
        theirs = one.compute_channels(wanted).reshape(-1) * np.sqrt(64)
        np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-5 * np.abs(ours).max())  # complex64


def test_deepmimo_describes_radio_room_and_motion(scenario, capsys):
    import deepmimo

    scene, _, found = scenario
    deepmimo.summary("paper_room")
    assert "10.0 GHz" in capsys.readouterr().out
    assert len(found.datasets[0].scene.objects) == len(scene.reflectors)
    found.set_timestamps(list(scene.agent.time))
    np.testing.assert_allclose(np.ravel(found.datasets[1].rx_vel), scene.agent.velocity[1], atol=1e-9)


def test_rerun_verifies_a_recording(result, tmp_path):
    file = tmp_path / "run.rrd"
    file.write_bytes(recording_bytes(result, "test"))
    program = str(Path(sys.executable).with_name("rerun"))

    def rerun(*words):
        return subprocess.run([program, "rrd", *words], capture_output=True, text=True, timeout=120, check=False)

    checked = rerun("verify", str(file))
    assert checked.returncode == 0, checked.stderr
    assert "verified without error" in checked.stdout + checked.stderr
    listed = rerun("stats", str(file)).stdout
    for entity in ("/truth/room", "/random/agent", "/no_ris/ellipsoid", "/error/random"):
        assert entity in listed, listed
