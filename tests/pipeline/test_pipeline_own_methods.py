"""Methods of one's own, as the how-to shows them: in a run, in a sweep on workers, in the identity of a run."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rislam_rt
from rislam_rt.errors import ConfigError
from rislam_rt.model import SlamResult, empty_map, pose_estimate
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.own_method_files import own_digests
from rislam_rt.pipeline.own_methods import load_own, own_code
from rislam_rt.pipeline.scores.component_sources import uses_wall_returns
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.shipped import find_pipeline
from rislam_rt.studies.pipeline_sweep import slam_sweep
from rislam_rt.sweeps import SweepOptions, run_sweep

FAULTS = """
import sys
from rislam_rt.model import MapEstimate
number = 3

def raises(belief, panel, radio, *, rng):
    raise ValueError("first line\\nsecond line")

def leaves(belief, panel, radio, *, rng):
    sys.exit(0)

def takes_nothing():
    return 0

def ragged(belief, panel, radio, *, rng):
    return [[1, 2], [3]]

class WantsArguments:
    def __init__(self, argument): ...
    def init(self): ...
    def step(self): ...
    def estimate(self): ...

class StepAlone:
    def step(self): ...

class NoStep:
    def init(self): ...
    def estimate(self): ...

class Nothing:
    def init(self, *given, **named): ...
    def step(self, *given, **named): ...
    def estimate(self, state): ...

class Away(Nothing):
    def init(self, start, body, panel, sensor, *, rng):
        return body
    def estimate(self, state):
        return pose_estimate(np.full(3, 1e200), np.zeros(3), 0.0, np.eye(6), state)

class Lost(Away):
    def estimate(self, state):
        return pose_estimate(np.full(3, np.nan), np.zeros(3), 0.0, np.eye(6), state)

class Negative(Away):
    def estimate(self, state):
        return pose_estimate(np.zeros(3), np.zeros(3), 0.0, np.diag([1.0, 1.0, -1e-3, 1.0, 1.0, 1.0]), state)

class NoHeading(Away):
    def estimate(self, state):
        return pose_estimate(np.zeros(3), np.zeros(3), np.nan, np.eye(6), state)

class Mapped(Away):
    part = {}
    def estimate(self, state):
        known = dict(
            ident=[4], position=np.zeros((1, 3)), covariance=np.eye(3)[None], parent=[-1], ris_probability=[1.0],
            strength=[0.1], wall_normal=[[0.0, 0.0, 1.0]], wall_offset=[0.0], wall_std=[[0.1, 0.1]],
        )
        return pose_estimate(np.zeros(3), np.zeros(3), 0.0, np.eye(6), state, MapEstimate(**(known | self.part)))

class NoSuchParent(Mapped):
    part = {"parent": [5]}

class ItsOwnParent(Mapped):
    part = {"parent": [0]}

class NegativeMap(Mapped):
    part = {"covariance": [np.diag([1.0, 1.0, -1e-3])]}

class NoneHeading(Away):
    def estimate(self, state):
        return pose_estimate(np.zeros(3), np.zeros(3), None, np.eye(6), state)

class TooSure(Mapped):
    part = {"ris_probability": [7.0]}

class LongNormal(Mapped):
    part = {"wall_normal": [[0.0, 0.0, 2.0]]}

class Unnumbered(Mapped):
    part = {"ident": [-1]}

class Counting(Away):
    # its cycles, from its making on
    use_vt = True
    def __init__(self):
        self.count = 0
    def step(self, state, *given, **named):
        self.count += 1
        return state
    def estimate(self, state):
        return pose_estimate(np.full(3, float(self.count)), np.zeros(3), 0.0, np.eye(6), state)

class NoPaths:
    def __init__(self, scene, radio, depth): ...
    def paths(self, trajectory): ...

class NoChannel: ...
"""
"""Methods at fault, beside the how-to's examples."""
PAGE = (Path(__file__).parents[2] / "docs" / "own_methods.md").read_text()
FILES = [block for block in re.findall(r"```python\n(.*?)```", PAGE, re.S) if block.startswith("# mine.py")]
QUICK = ["cycles=8", "channel=image_source", "depth=1", "receiver.estimator=bound", "radio.reference_snr_db=30"]


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The how-to's examples in one file, where Python finds it."""
    assert len(FILES) == 4
    file = tmp_path / "mine.py"
    file.write_text("\n".join(FILES) + "\n\ndef bad(belief, panel, radio, *, rng):\n    return [1.5]\n" + FAULTS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    load_own.cache_clear()
    return file


def run(schemes: str, *more: str) -> SlamResult:
    spec = load_spec(find_pipeline("trace_then_slam"), [*QUICK, f"schemes={schemes}", *more])
    return rislam_rt.run_slam(rislam_rt.load_scene("paper_room"), spec, rng=np.random.default_rng(3))


@pytest.mark.usefixtures("mine")
def test_a_designer_and_a_filter_take_part_in_a_run() -> None:
    found = run('["random", "mine:my_designer", "mine:DeadReckoning"]').schemes
    codes = found["mine:my_designer"].applied
    assert codes.shape == (8, 6, 6)
    # the panel is not in the map within 8 cycles: the example searches, with the draws that every scheme gets
    assert (codes == found["random"].applied).all()
    reckoned = found["mine:DeadReckoning"]
    step = np.diff(reckoned.position, axis=0)
    np.testing.assert_allclose(step, reckoned.velocity[1:] * 0.1, atol=1e-12)
    # its own deviations: 0.01 m at the start, and 0.01 m/s over seven steps of 0.1 s
    assert np.sqrt(reckoned.covariance[-1, 0, 0]) == pytest.approx(0.017)


@pytest.mark.usefixtures("mine")
def test_the_example_focuses_once_the_panel_is_known() -> None:
    scene, radio = rislam_rt.load_scene("paper_room"), rislam_rt.RadioConfig()
    assert scene.ris is not None
    panel, place = scene.ris.spec, np.array([1.5, 1.0, 0.5])
    known = replace(
        empty_map(), ident=[0], position=scene.ris.center[None], covariance=np.eye(3)[None], parent=[-1],
        ris_probability=[1.0], strength=[1.0],
    )  # fmt: skip
    belief = pose_estimate(place, np.zeros(3), 0.0, np.eye(6), scene.agent.body, known)
    code = own_code("mine:my_designer", belief, panel, radio, rng=np.random.default_rng(0))
    way = 2.0 * np.linalg.norm(scene.ris.center + panel.offsets() - place, axis=-1)
    phase = -2.0 * np.pi * way / radio.wavelength - code.xi
    # four levels leave each element within 45 degrees of the best phase: at least cos 45 degrees of the full sum
    assert np.abs(np.exp(1j * phase).sum()) > np.sqrt(0.5) * panel.num_elements


@pytest.mark.usefixtures("mine")
def test_what_an_object_remembers_of_one_run_is_not_in_the_next() -> None:
    for _ in range(2):
        found = run('["mine:Beams", "mine:Counting"]').schemes
        np.testing.assert_array_equal(found["mine:Beams"].sent[:, 0, 1], np.arange(8) % 4)
        np.testing.assert_array_equal(found["mine:Counting"].position[:, 0], np.arange(1.0, 9.0))


@pytest.mark.usefixtures("mine")
def test_a_filter_says_whether_it_uses_wall_returns() -> None:
    settings = build_settings(load_spec(find_pipeline("trace_then_slam"), QUICK))
    assert uses_wall_returns("mine:Counting", settings)
    assert not uses_wall_returns("mine:DeadReckoning", settings)


@pytest.mark.usefixtures("mine")
def test_a_channel_takes_the_place_of_ours() -> None:
    paths = run('["no_ris"]', "channel=mine:WithoutFloor").paths
    floor = paths.walls.index("floor")
    over = ((paths.tx_walls == floor) | (paths.rx_walls == floor)).any(axis=1)
    assert over.any()
    assert not paths.valid[:, over].any()


@pytest.mark.usefixtures("mine")
def test_in_a_sweep_on_workers(tmp_path: Path) -> None:
    settings = [*QUICK, 'schemes=["mine:DeadReckoning", "no_ris"]']
    sweep = slam_sweep(find_pipeline("trace_then_slam"), settings, ["radio.reference_snr_db=0,30"], repeat=1)
    report = run_sweep(sweep, tmp_path / "sweep", SweepOptions(jobs=2))
    assert not report.failed
    assert len(report.rows) == 2
    assert all(set(row.result["schemes"]) == {"mine:DeadReckoning", "no_ris"} for row in report.rows)


def test_the_file_is_part_of_the_identity(mine: Path) -> None:
    before = own_digests(["random", "mine:my_designer"])
    assert list(before) == ["mine:my_designer"]
    mine.write_text(mine.read_text() + "\n# changed\n")
    assert own_digests(["mine:my_designer"]) != before


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize(
    ("schemes", "said"),
    [
        ('["optimised"]', "did you mean 'optimized'"),
        ('["mine:nobody"]', "module 'mine' .*mine.py. has no 'nobody'"),
        ('["nowhere:f"]', "put nowhere.py beside the pipeline file"),
        ('["mine:bad"]', r"give whole numbers \(6, 6\) from 0 to 3"),
        ('["mine:raises"]', "raised ValueError: first line second line in line [0-9]+ of .*mine.py; mend it"),
        ('["mine:leaves"]', "raised SystemExit: 0"),
        ('["mine:takes_nothing"]', "raised TypeError: takes_nothing"),
        ('["mine:ragged"]', "raised ValueError: setting an array element"),
        ('["mine:number"]', "int received; give a function"),
        ('["os:path"]', "module received; give a function"),
        ('["math:sin"]', "raised TypeError"),
        ('["mine:WantsArguments"]', "cannot be made"),
        ('["mine:StepAlone"]', "has 'step' and no 'init'"),
        ('["mine:NoStep"]', "has 'init' and 'estimate' and no 'step'"),
        ('["mine:Lost"]', "'mine:Lost': SlamEstimate.position: NaN"),
        ('["mine:Nothing"]', "estimate: NoneType received; give a SlamEstimate"),
        ('["mine:Away"]', "estimate: a position of 1e[+]200 m"),
        ('["mine:Negative"]', "estimate: a covariance with an eigenvalue of -0.001"),
        ('["mine:NoHeading"]', "'mine:NoHeading': estimate: a heading of nan returned"),
        ('["mine:NoSuchParent"]', r"'mine:NoSuchParent': estimate: map: parent \[5\] returned; give rows"),
        ('["mine:ItsOwnParent"]', r"map: parent \[0\] returned; give rows .* other than its own"),
        ('["mine:NegativeMap"]', r"estimate: map: a covariance with an eigenvalue of -0.001 returned"),
        ('["mine:NoneHeading"]', r"a heading of None returned; give a finite number of radians"),
        ('["mine:TooSure"]', r"map: ris_probability \[7.\] returned; give numbers from 0 to 1"),
        ('["mine:LongNormal"]', "map: wall_normal .* returned; give unit vectors"),
        ('["mine:Unnumbered"]', r"map: ident \[-1\] returned"),
    ],
)
def test_what_is_wrong_is_one_line(schemes: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said) as raised:
        run(schemes)
    assert "\n" not in str(raised.value)


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize(
    ("channel", "said"),
    [
        ("mine:NoPaths", "paths: NoneType received; give a Paths"),
        ("mine:NoChannel", "raised TypeError: NoChannel"),
        ("mine:number", "int received"),
    ],
)
def test_what_is_wrong_with_a_channel_is_one_line(channel: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        run('["no_ris"]', f"channel={channel}")


def test_a_file_that_ends_the_program_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "script_of_mine.py").write_text("import sys\nsys.exit(0)\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError, match="script_of_mine cannot be loaded"):
        run('["script_of_mine:f"]')


def test_what_python_has_built_in_has_no_digest() -> None:
    assert own_digests(["sys:intern"]) == {"sys:intern": ""}
