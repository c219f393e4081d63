"""What the adviser says of a room, held against the receiver's draws, against codes tried out, and against geometry."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.adviser.advice import advise
from rislam_rt.adviser.coverage import panel_coverage
from rislam_rt.adviser.forecast_codes import aimed_paths
from rislam_rt.adviser.link_budget import LandmarkLink, Survey, forecast_detection, link_budget, survey
from rislam_rt.adviser.remedies import HEARD, detection_label, enough_elements, lack_db, remedies, weak_places
from rislam_rt.adviser.tracing_cost import COUNTED, cost_words, trace_cost
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import measure
from rislam_rt.model import Occluder, PathKind, RisCode, RisPanel, Scene
from rislam_rt.model.ris import join_panels
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.specification.pipeline_spec import Settings, build_settings
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]


def settings(*changed: str) -> Settings:
    return build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed))


@cache
def look(scene: Scene, *changed: str, places: int = 3) -> tuple[Survey, dict[tuple[str, str], LandmarkLink]]:
    """What is said of a room at a few places; of those that several tests look at, once."""
    looked = survey(scene, settings(*changed), places)
    return looked, {(link.landmark, link.code): link for link in link_budget(looked, rng=np.random.default_rng(1))}


@pytest.fixture(scope="module")
def paper() -> Scene:
    return load_scene(ROOT / "scenes" / "paper_room")


@pytest.fixture(scope="module")
def office() -> Scene:
    return load_scene(ROOT / "scenes" / "office")


@pytest.mark.parametrize("changed", [(), pytest.param(("receiver.alternation=false",), marks=pytest.mark.slow)])
def test_the_chance_of_being_heard_is_the_share_of_the_receivers_own_draws(paper: Scene, changed: tuple[str]) -> None:
    looked = survey(paper, settings("receiver.estimator=bound", "radio.reference_snr_db=0", *changed), places=2)
    rng, draws = np.random.default_rng(5), 200
    assert paper.ris is not None
    paths = aimed_paths(looked.paths, paper.ris.spec, looked.settings.radio)
    for place in range(2):
        heading = float(looked.scene.agent.heading[place])
        said, count = forecast_detection(paths, place, heading, looked.settings).probability, np.zeros(2)
        for _ in range(draws):
            _, truth = measure(paths, place, heading, looked.settings.radio, looked.settings.receiver, rng=rng)
            owner = paths.landmark[truth.path[truth.path >= 0]]
            count += [np.any(owner == landmark) for landmark in range(2)]
        deviation = np.sqrt(np.maximum(said * (1.0 - said), 1.0 / draws) / draws)
        assert (np.abs(count / draws - said) < 4.0 * deviation).all()


def test_no_random_code_beats_the_aimed_one(paper: Scene) -> None:
    assert paper.ris is not None
    looked = survey(paper, settings(), places=4)
    panel = looked.paths.kind >= PathKind.RIS
    best = np.abs(aimed_paths(looked.paths, paper.ris.spec, looked.settings.radio).gain[:, panel])
    rng = np.random.default_rng(2)
    for _ in range(20):
        other = rng.integers(paper.ris.spec.levels, size=(looked.paths.num_cycles, 6, 6))
        gain = np.abs(rephase(looked.paths, RisCode(other, paper.ris.spec.levels)).gain[:, panel])
        assert (gain.max(axis=1) < best.max(axis=1)).all()


def test_margins_follow_the_noise_and_the_codes_stand_in_order(paper: Scene) -> None:
    _, loud = look(paper)
    _, soft = look(paper, "radio.reference_snr_db=0")
    for key, link in loud.items():
        np.testing.assert_allclose(link.margin_db - soft[key].margin_db, 13.0, rtol=0, atol=1e-9)
        assert soft[key].share < link.share
    aimed, swept, random = (loud["ris", code].margin_db for code in ("aimed", "swept", "random"))
    assert (aimed >= swept).all()
    assert (aimed > random + 6.0).all()
    assert set(loud) == {("sphere", ""), ("ris", "aimed"), ("ris", "swept"), ("ris", "random")}


def test_every_reason_is_found_where_it_holds(paper: Scene, office: Scene) -> None:
    _, links = look(office, "radio.reference_snr_db=0")
    assert "shaded by 'screen'" in links["lamp", ""].reason
    assert "shaded by 'partition'" in links["ris", "aimed"].reason
    _, links = look(office)
    assert "too weak" in links["ris", "random"].reason
    assert isinstance(paper.ris, RisPanel)
    turned = replace(paper, ris=replace(paper.ris, spec=replace(paper.ris.spec, normal=np.array([0.0, 0.0, 1.0]))))
    looked, links = look(turned)
    assert set(links["ris", "aimed"].reason) == {"the agent is behind the panel"}
    assert any(
        "the agent is behind the panel on 100% of it (turn" in line for line in remedies(looked, [*links.values()])
    )
    low = replace(paper, scatterers=(replace(paper.scatterers[0], position=np.array([2.0, 1.0, 0.1])),))
    _, links = look(replace(low, reflectors=tuple(r for r in low.reflectors if r.name != "ceiling"), ris=None))
    assert "below the array, which hears from above only" in links["sphere", ""].reason
    # loud enough, and later than the receiver looks: 8 ns are 2.4 m of path
    looked, links = look(paper, "receiver.max_delay=8e-9")
    assert set(links["ris", "aimed"].reason) == {"beyond the receiver's delays"}
    assert any("a larger receiver.max_delay" in line for line in remedies(looked, [*links.values()]))


def test_what_hides_and_reflects_nothing_is_named(paper: Scene) -> None:
    box = np.array([[x, y, z] for x in (1.7, 2.3) for y in (0.7, 1.3) for z in (0.7, 1.3)])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    _, links = look(replace(paper, occluders=(Occluder(box, faces, "crate"),)))
    assert set(links["sphere", ""].reason) == {"shaded by 'crate'"}


def test_a_covered_path_names_what_covers_it_and_alternated_codes_uncover_a_panel() -> None:
    scene = load_scene(ROOT / "scenes" / "shaded_room")
    held, links = look(scene, "receiver.alternation=false", places=3)
    link = links["ris", "random"]
    said = [reason for reason in link.reason if reason.startswith("not to be told from")]
    assert said
    assert all(reason.split()[5] in ("VT", "VS", "PS", "LOS") for reason in said)
    unheard = link._replace(code="aimed", probability=np.zeros(3))
    assert any("or receiver.alternation = true" in line for line in remedies(held, [unheard]))
    alternated, links = look(scene, places=3)
    assert not any(reason.startswith("not to be told from") for reason in links["ris", "random"].reason)
    assert not any("receiver.alternation" in line for line in remedies(alternated, [unheard]))


def test_what_lacks_is_what_would_do(paper: Scene) -> None:
    faint, links = look(paper, "radio.reference_snr_db=-12", places=5)
    link = links["ris", "aimed"]
    lack = lack_db(link)
    assert detection_label(link) != "heard"
    assert lack > 0.0
    weak = weak_places(link)
    _, less = look(paper, f"radio.reference_snr_db={-12 + lack + 0.1}", places=5)
    assert float(np.median(less["ris", "aimed"].margin_db[weak])) == pytest.approx(0.1, abs=1e-9)
    assert isinstance(paper.ris, RisPanel)
    grown = enough_elements(faint, paper.ris, link)
    assert grown is not None
    share = {}
    for rows in (grown.rows, grown.rows - 2):
        panel = replace(paper.ris, spec=replace(grown, rows=rows, cols=rows))
        _, tried = look(replace(paper, ris=panel), "radio.reference_snr_db=-12", places=5)
        share[rows] = float(np.mean(tried["ris", "aimed"].margin_db[weak] >= 0.0))
    assert share[grown.rows] >= 0.5 > share[grown.rows - 2]
    line = next(line for line in remedies(faint, [*links.values()]) if line.startswith("ris: "))
    assert f"{lack:.1f} dB lack" in line
    assert f"a panel of {grown.rows} x {grown.cols} elements (now 6 x 6)" in line


def test_a_panel_that_no_size_mends_and_one_that_is_hard_to_find_are_told(paper: Scene) -> None:
    looked, links = look(paper, "radio.reference_snr_db=-80")
    assert any("no panel of up to 128 elements a side would do" in line for line in remedies(looked, [*links.values()]))
    hall = load_scene(ROOT / "scenes" / "large_hall")
    looked, links = look(hall, "radio.reference_snr_db=0")
    assert links["ris", "aimed"].share > HEARD
    assert any("it may be found late or never" in line for line in remedies(looked, [*links.values()]))


def test_the_map_agrees_with_the_budget(paper: Scene, office: Scene) -> None:
    said = settings()
    (coverage,) = panel_coverage(office, said)
    assert np.isnan(coverage.margin_db).any()
    assert coverage.margin_db.shape == (len(coverage.y), len(coverage.x))
    y, x = np.unravel_index(np.nanargmax(coverage.margin_db), coverage.margin_db.shape)
    assert isinstance(office.ris, RisPanel)
    step = coverage.x[1] - coverage.x[0]
    assert np.hypot(coverage.x[x] - office.ris.center[0], coverage.y[y] - office.ris.center[1]) < 2.0 * step
    here = replace(office, agent=office.agent[:1])
    point = np.array([[coverage.x[x], coverage.y[y], coverage.height]])
    still = replace(here, agent=replace(here.agent, position=point, heading=np.zeros(1)))
    paths = ImageSourceChannel(still, said.radio, 0).paths(still.agent)
    snr = said.radio.integrated_snr(aimed_paths(paths, office.ris.spec, said.radio).gain)
    direct = float(snr[0, paths.kind == PathKind.RIS][0])
    assert coverage.margin_db[y, x] == pytest.approx(10.0 * np.log10(direct / said.sensor.threshold), abs=1e-9)
    assert panel_coverage(replace(paper, ris=None), said) == []


def test_two_panels_are_judged_as_each_alone(paper: Scene) -> None:
    """Elements of one reflect nothing of the other's paths; what changes is which other paths cover one."""
    assert isinstance(paper.ris, RisPanel)
    spec = replace(paper.ris.spec, normal=np.array([0.0, 1.0, 0.0]), up=np.array([0.0, 0.0, 1.0]), rows=4)
    other = RisPanel(spec, np.array([3.0, 0.0, 1.5]), "wall_y0", "second")
    both = replace(paper, ris=join_panels((paper.ris, other)))
    looked, links = look(both)
    for alone in (paper, replace(paper, ris=other)):
        _, single = look(alone)
        name = alone.panels[0].name
        for code in ("aimed", "swept"):
            np.testing.assert_allclose(links[name, code].margin_db, single[name, code].margin_db, rtol=0, atol=1e-9)
    assert [one.panel for one in panel_coverage(both, looked.settings)] == ["ris", "second"]
    first, _ = panel_coverage(both, looked.settings)
    (lone,) = panel_coverage(paper, looked.settings)
    assert abs(np.nanmax(first.margin_db) - np.nanmax(lone.margin_db)) < 1.0  # the grids differ


def test_the_cost_counts_what_there_is(paper: Scene) -> None:
    costs = trace_cost(paper, settings().radio, 6)
    middle = paper.agent[len(paper.agent) // 2 :][:1]
    for cost in costs:
        paths = ImageSourceChannel(paper, settings().radio, cost.depth).paths(middle)
        assert cost.paths == paths.valid.sum()
        assert cost.sequences >= cost.paths
    # five legs, of which those to the panel meet five walls
    assert costs[0].sequences == 5 + 3 * 6 + 2 * 5
    hall = trace_cost(load_scene(ROOT / "scenes" / "large_hall"), settings().radio, 186)
    assert hall[2].seconds is None
    assert hall[2].sequences > COUNTED
    assert "no estimate" in cost_words(hall[2])
    assert cost_words(costs[0]).startswith("1 bounce: 33 wall sequences, 31 paths at a time, ")


def test_a_room_without_anything_to_hear_still_has_its_cost(paper: Scene) -> None:
    empty = load_scene(ROOT / "scenes" / "empty_box")
    advice = advise(empty, settings(), rng=np.random.default_rng(0))
    assert advice.links == []
    assert [cost["walls"] for cost in advice.as_dict()["costs"]] == [6, 6, 6]
    one = advise(replace(paper, agent=paper.agent[:1]), settings(), rng=np.random.default_rng(0))
    assert len(one.links[0].margin_db) == 1
