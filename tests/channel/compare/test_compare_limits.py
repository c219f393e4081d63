"""The limits: what is within them, what is beyond, and that they come from precision and geometry."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.compare import compare_paths
from rislam_rt.channel.compare.error_limits import DOUBLE, SINGLE, RoomPrecision, field_error
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Material, RadioConfig, RisCode
from rislam_rt.model.itu import ITU_MATERIALS
from rislam_rt.model.slab import relative_permittivity, slab_coefficients

RADIO = RadioConfig()
POSES = [[1.1, 2.3, 1.2], [2.4, 4.7, 0.5]]
QUANTITIES = ("length [m]", "gain [of the coherent scale]", "phase [rad]", "departure [rad]", "arrival [rad]")


@pytest.fixture(scope="module")
def both(rooms):
    """Scene, poses, and the analytic paths as both sides, one of them said to be the tracer's own."""
    scene, trajectory = rooms.paper(), rooms.at(POSES)
    channel = ImageSourceChannel(scene, RADIO, 2)
    code = RisCode(np.random.default_rng(1).integers(4, size=(6, 6)), 4)
    paths = channel.respond(channel.paths(trajectory), code)
    return scene, trajectory, replace(paths, source="traced"), paths


@pytest.fixture(scope="module", params=["traced", "traced, refined"])
def fine(request, both):
    """One side said to be the tracer's own, or refined, and its comparison without any error put in."""
    scene, trajectory, traced, analytic = both
    traced = replace(traced, source=request.param)
    return traced, compare_paths(traced, analytic, scene, trajectory)


def worse(paths, label, cycle, quantity, size):
    """The paths with one error put in."""
    path = [paths.label(p) for p in range(paths.num_paths)].index(label)
    tau, gain = paths.tau.copy(), paths.gain.copy()
    departure, arrival = paths.departure.copy(), paths.arrival.copy()
    if quantity.startswith("length"):
        tau[cycle, path] += size / SPEED_OF_LIGHT
    elif quantity.startswith("gain"):
        gain[cycle, path] *= 1.0 + size
    elif quantity.startswith("phase"):
        gain[cycle, path] *= np.exp(1j * size)
    else:
        ray = (departure if quantity.startswith("departure") else arrival)[cycle, path]
        aside = np.cross(ray, [0.3, 0.5, -0.8])
        ray += np.tan(size) * aside / np.linalg.norm(aside)
        ray /= np.linalg.norm(ray)
    return replace(paths, tau=tau, gain=gain, departure=departure, arrival=arrival)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("label", ["LOS", "VT wall_x0 floor", "VS sphere | ceiling", "VRIS floor ris"])
def test_an_error_beyond_its_limit_names_the_path(both, fine, label, quantity):
    (scene, trajectory, _, analytic), (traced, fine) = both, fine
    assert fine.passed
    row = next(r for r in range(fine.matched) if fine.cycle[r] == 1 and fine.labels[fine.path[r]] == label)
    limit = fine.judged[quantity][1][row]
    over = 2.0 * limit
    if quantity.startswith("gain") and label.startswith("VRIS"):  # as a part of the sum over the elements
        path = [analytic.label(p) for p in range(analytic.num_paths)].index(label)
        legs = analytic.ris.tx[1, analytic.ris.tx_leg[path]] * analytic.ris.rx[1, analytic.ris.rx_leg[path]]
        over *= np.abs(legs).sum() / np.abs(analytic.gain[1, path])
    report = compare_paths(worse(traced, label, 1, quantity, over), analytic, scene, trajectory)
    assert not report.passed
    assert report.unexplained == 0
    (breach,) = report.breaches
    assert (breach.cycle, breach.label, breach.quantity) == (1, label, quantity)
    assert breach.limit == pytest.approx(limit)
    assert breach.value == pytest.approx(2.0 * limit, rel=1e-3)
    assert label in str(breach)
    within = compare_paths(worse(traced, label, 1, quantity, 0.2 * over), analytic, scene, trajectory)
    assert within.passed


def test_json_holds_limits_and_breaches(both):
    scene, trajectory, traced, analytic = both
    numbers = compare_paths(worse(traced, "LOS", 0, "gain", 1e-3), analytic, scene, trajectory).as_dict()
    assert tuple(numbers["limits"]) == QUANTITIES
    for limits in numbers["limits"].values():
        assert 0.0 < limits["smallest"] <= limits["median"] <= limits["largest"]
    nearest = numbers["limits"]["gain [of the coherent scale]"]["nearest"]
    assert (nearest["cycle"], nearest["path"]) == (0, "LOS")
    assert (numbers["passed"], numbers["num_breaches"], len(numbers["breaches"])) == (False, 1, 1)
    assert numbers["breaches"][0]["value"] == pytest.approx(1e-3)


def test_a_null_of_the_panel_is_judged_by_the_sum_over_its_elements(both):
    """1e-7 of every element, at random, is many decibels of a null and no breach; 1e-2 of them all is one."""
    scene, trajectory, _, analytic = both
    label = "RIS ris"
    path = [analytic.label(p) for p in range(analytic.num_paths)].index(label)
    legs = analytic.ris.tx[0, analytic.ris.tx_leg[path]] * analytic.ris.rx[0, analytic.ris.rx_leg[path]]
    scale = np.abs(legs).sum()
    gain = analytic.gain.copy()
    gain[0, path] = 1e-8 * scale
    null = replace(analytic, gain=gain)
    for error, breaches in ((1e-7, 0), (1e-2, 1)):
        moved = gain.copy()
        moved[0, path] += error * scale
        report = compare_paths(replace(null, gain=moved, source="traced"), null, scene, trajectory)
        assert report.gain_error_db.max() > 15.0
        assert report.num_breaches == breaches
        assert report.gain_error.max() == pytest.approx(error, rel=1e-6)


def test_limits_scale_with_precision_and_room(rooms, both):
    """In float64 2^29 times smaller, but for float32 materials; in a room of ten times the size ten times larger."""
    scene, trajectory, _, analytic = both
    assert SINGLE / DOUBLE == 2.0**29
    cycle, path = np.nonzero(analytic.valid)
    scale = np.abs(analytic.gain[cycle, path])
    single, double = (
        RoomPrecision.of(scene, RADIO, single=flag).limits(analytic, cycle, path, trajectory, scale)
        for flag in (True, False)
    )
    bounced = analytic.num_vertices[path] > (analytic.landmark[path] >= 0)
    assert (single.length / double.length > 2.0**27).all()
    assert (single.aod / double.aod)[bounced].min() > 2.0**28  # rays off their surfaces besides
    large = rooms.scene(rooms.box((0, 0, 0), (60, 60, 30)), ris=rooms.panel(center=(30.0, 30.0, 30.0)))
    large = replace(large, scatterers=(replace(large.scatterers[0], position=np.array([20.0, 10.0, 10.0])),))
    there = rooms.at(10.0 * np.array(POSES), tx=(-0.4, -0.3, 0.1), rx=(0.4, 0.3, -0.1))
    tenfold = RoomPrecision.of(large, RADIO, single=True).limits(
        ImageSourceChannel(large, RADIO, 2).paths(there), cycle, path, there, scale
    )
    # the rays' offsets have a constant part, 1 m, which counts to the second order where segments are short
    np.testing.assert_allclose(tenfold.length, 10.0 * single.length, rtol=0.1)
    np.testing.assert_allclose(np.median(tenfold.length / single.length), 10.0, rtol=1e-3)


def test_float32_slabs_are_within_their_limit(rooms):
    """Sionna's own materials at 10 GHz, over all angles, against float64."""
    from rislam_rt.channel.traced import TracedChannel

    names = sorted(n for n, rows in ITU_MATERIALS.items() if any(r[0] <= 10.0 <= r[1] for r in rows))
    materials = [Material(itu=name, thickness=d) for name in names for d in (0.003, 0.02, 0.25)]
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    boards = [
        rooms.polygon(f"board{n}", corners + np.array([0, 0, n]), material) for n, material in enumerate(materials)
    ]
    channel = TracedChannel(rooms.scene(boards), RADIO, 1)

    from rislam_rt.channel.traced.fields import incidence_jones

    cosine = np.linspace(2e-3, 1.0, 3001)
    assert len(materials) >= 30
    for material, theirs in zip(materials, channel.tracer_scene.materials, strict=True):
        found = incidence_jones(theirs, cosine)
        permittivity = np.array(relative_permittivity(material.itu, RADIO.carrier))
        te, tm = slab_coefficients(cosine, permittivity, np.array(material.thickness), RADIO.carrier)
        error = max(np.abs(found[:, 0, 0] - te).max(), np.abs(found[:, 1, 1] - tm).max())
        assert error <= field_error(material, RADIO.carrier), material
        assert np.abs(found[:, 0, 1]).max() < 1e-6


def test_compare_exits_1_for_a_gain_error_put_in(capsys, monkeypatch, tmp_path):
    """One gain in a thousand of one path of the tracer's own numbers, through the command line."""
    import json
    import sys

    from rislam_rt.channel.compare import channel_comparison
    from rislam_rt.cli import main

    scene = Path(__file__).parents[3] / "scenes" / "empty_box"
    command = ["rislam-rt", "compare", str(scene), "--poses", "3", "--depth", "1", "--json", str(tmp_path / "out.json")]
    honest = channel_comparison.trace_both

    def off(*arguments, **options):
        traced, analytic, trajectory = honest(*arguments, **options)
        return (
            (worse(traced, "VT floor", 2, "gain", 1e-3) if "refined" not in traced.source else traced),
            analytic,
            trajectory,
        )

    for replaced, code in ((honest, 0), (off, 1)):
        monkeypatch.setattr(channel_comparison, "trace_both", replaced)
        monkeypatch.setattr(sys, "argv", command)
        with pytest.raises(SystemExit) as left:
            main()
        assert left.value.code == code
        text, content = capsys.readouterr().out, json.loads((tmp_path / "out.json").read_text())
        assert content["verdict"] == {"passed": not code, "evidence": "float32", "float32": not code, "refined": True}
        assert content["float32"]["num_breaches"] == code
        assert ("beyond its limit: float32, cycle 2, VT floor: error of gain" in text) == bool(code)
        assert content["limits"]["length [m]"]["nearest"]["share"] < 1.0
