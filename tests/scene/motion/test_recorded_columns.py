"""Columns of a recording: what their names say, and that none is passed over which was meant."""

import numpy as np
import pytest

from rislam_rt.scene.findings import Fault
from rislam_rt.scene.motion.recorded_columns import find_columns
from rislam_rt.scene.motion.recorded_poses import parse_csv, parse_tum

PLACE = ["time", "x", "y", "z"]


def refused(header: list[str], named: dict[str, str] | None = None) -> str:
    with pytest.raises(Fault, match=r".") as caught:
        find_columns(header, named or {})
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("heading", 1.0), ("yaw_deg", np.pi / 180), ("Yaw (deg)", np.pi / 180), ("yaw[degrees]", np.pi / 180),
     ("heading_rad", 1.0), (" Heading ", 1.0)],
)  # fmt: skip
def test_a_heading_is_read_under_its_usual_names_and_units(name: str, unit: float) -> None:
    assert find_columns([*PLACE, "note", name], {})["heading"] == (5, pytest.approx(unit))


@pytest.mark.parametrize(
    ("name", "meant"),
    [("bearing", "heading"), ("headng", "heading"), ("theta_deg", "heading"), ("heading_true", "heading"),
     ("yawDeg", "heading"), ("quat_x", "qx"), ("orientation_w", "qw")],
)  # fmt: skip
def test_a_heading_under_another_name_is_not_passed_over(name: str, meant: str) -> None:
    line = refused([*PLACE, "note", name])
    assert f"column '{name}' of the trajectory seems to be a heading" in line
    assert f"did you mean '{meant}'?" in line
    assert f'columns = {{ {meant} = "{name}" }}' in line


@pytest.mark.parametrize(
    ("header", "says"),
    [("stamp,pos_x,pos_y,pos_z", '{ time = "stamp" }'), ("t,qx,px,py,pz", '{ x = "px" }'),
     ("t,x,y,z_map", '{ z = "z_map" }'), ("t,x,y,height", '{ z = "..." }; the file has \'t\', \'x\'')],
)  # fmt: skip
def test_a_missing_column_is_told_with_the_likeliest(header: str, says: str) -> None:
    assert f"name it in agent.columns, e.g. columns = {says}" in refused(header.split(","))


def test_what_is_told_about_a_heading_and_all_other_columns_are_left_alone() -> None:
    others = ["yaw_rate", "heading_std_deg", "x_std", "vx", "time_offset", "note"]
    assert set(find_columns([*others, *PLACE], {})) == set(PLACE)
    assert find_columns([*others, *PLACE], {})["x"][0] == len(others) + 1
    assert "heading" in find_columns([*PLACE, "yaw", "bearing"], {})
    assert find_columns([*PLACE, "bearing"], {"heading": "bearing"})["heading"] == (4, 1.0)


def test_half_a_quaternion_and_two_columns_for_one_quantity_are_refused() -> None:
    assert "a quaternion without 'qw'" in refused([*PLACE, "qx", "qy", "qz"])
    assert "columns 'x' and 'x_mm' of the trajectory may both be 'x'; name it" in refused([*PLACE, "x_mm"])
    assert find_columns([*PLACE, "x_mm"], {"x": "x_mm"})["x"] == (4, 1e-3)


def recording(column: str, heading: np.ndarray, step: float, course: np.ndarray | None = None) -> bytes:
    """CSV file of poses every `step` seconds that go at 0.3 m/s along a course (K,) [rad], or stand still."""
    velocity = (
        np.zeros((len(heading), 2)) if course is None else 0.3 * np.column_stack([np.cos(course), np.sin(course)])
    )
    x, y = (step * np.cumsum(velocity, axis=0)).T
    rows = "".join(f"{step * k},{x[k]},{y[k]},1,{heading[k]}\n" for k in range(len(heading)))
    return f"t,x,y,z,{column}\n{rows}".encode()


def turning(rate: float, to: float, step: float, begin: float = 0.0) -> np.ndarray:
    """Heading that turns by `rate` a second from `begin` on until it reaches `to`, and then stays."""
    time = np.arange(0.0, (to - begin) / rate + 5.0, step)
    return np.minimum(begin + rate * time, to)


@pytest.mark.parametrize("step", [0.01, 0.1, 2.0])
@pytest.mark.parametrize("moving", [True, False])
def test_a_heading_that_turns_on_is_wrapped(step: float, moving: bool) -> None:
    """As odometry has it after a spiral, or a robot that looks about where it stands."""
    turned = turning(1.4, 21.6, step, begin=-3.0)
    for column, scale in (("yaw", 1.0), ("yaw_deg", 180.0 / np.pi)):
        content = recording(column, scale * turned, step, turned + 0.3 if moving else None)
        found = parse_csv(content, {}).heading
        assert found is not None
        assert np.abs(found).max() <= np.pi
        np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * turned), atol=1e-12)


@pytest.mark.parametrize(
    ("degrees", "step", "along", "why"),
    [
        (np.arange(30.0, 60.0), 0.1, False, "a heading of 59 rad in the trajectory, and it begins at 30 rad"),
        (np.arange(0.0, 91.0), 0.1, False, "and 10 rad in the second after pose 0"),
        (np.repeat([0.0, 90.0, 180.0], 20), 0.1, False, "and 90 rad from pose 19 to the next"),
        (turning(3.3, 90.0, 0.1), 0.1, False, "and 3.3 rad in the second after pose"),
        (turning(1.0, 90.0, 0.1), 0.1, True, "and as degrees they point along the way"),
    ],
)
def test_degrees_that_are_called_radians_are_refused(degrees: np.ndarray, step: float, along: bool, why: str) -> None:
    """They begin, step or turn as no heading in radians, or point along the way as degrees, however slow they turn."""
    course = np.radians(degrees) + 0.3 if along else None
    with pytest.raises(Fault, match=r"; call the column 'heading_deg' if these are degrees") as caught:
        parse_csv(recording("yaw", degrees, step, course), {})
    assert why in str(caught.value)
    found = parse_csv(recording("yaw_deg", degrees, step, course), {}).heading
    assert found is not None
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * np.radians(degrees)), atol=1e-9)


@pytest.mark.parametrize("turned_out", [0.0, 0.01, 0.05])
def test_who_turns_on_the_spot_and_then_goes_straight_is_believed(turned_out: float) -> None:
    """On a straight way headings that stay, read as degrees, point along it as well as any one heading does."""
    heading = turning(1.0, 8.0 * np.pi, 0.1)
    noise = turned_out * np.random.default_rng(1).standard_normal(len(heading))
    moves = np.arange(len(heading)) > len(heading) - 40
    rows = "".join(
        f"{0.1 * k},{0.03 * moves[:k].sum()},1,1,{heading[k] + noise[k]}\n" for k in range(len(heading))
    )  # fmt: skip
    found = parse_csv(f"t,x,y,z,yaw\n{rows}".encode(), {}).heading
    assert found is not None
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * (heading + noise)), atol=1e-12)


def test_a_column_that_says_its_unit_is_not_doubted() -> None:
    degrees = turning(1.0, 90.0, 0.1)
    found = parse_csv(recording("yaw_rad", degrees, 0.1, np.radians(degrees)), {}).heading
    assert found is not None
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * degrees), atol=1e-9)


def test_headings_without_measure_are_refused_in_one_line() -> None:
    with pytest.raises(
        Fault, match=r"a heading of 1e\+308 rad in the trajectory, and 1e\+11 rad from pose 0 to the next"
    ):
        parse_csv(recording("yaw", np.array([0.0, 1e308, -1e308]), 0.1), {})


def test_headings_that_can_only_be_degrees_are_refused() -> None:
    rows = "".join(f"{k},0,0,1,{10 * k}\n" for k in range(9))
    with pytest.raises(Fault, match=r"a heading of 80 rad .*; call the column 'heading_deg'"):
        parse_csv(f"t,x,y,z,yaw\n{rows}".encode(), {})
    found = parse_csv(f"t,x,y,z,yaw_deg\n{rows}".encode(), {}).heading
    assert found is not None
    np.testing.assert_allclose(found, np.radians(10.0 * np.arange(9)))


def test_a_byte_order_mark_and_old_line_ends_do_no_harm() -> None:
    expected = parse_csv(b"t,x,y,z\n0,1,2,3\n1,2,2,3\n", {})
    for content in (b"\xef\xbb\xbft,x,y,z\r\n0,1,2,3\r\n1,2,2,3\r\n", b"t,x,y,z\r0,1,2,3\r1,2,2,3\r"):
        assert np.array_equal(parse_csv(content, {}).position, expected.position)
    assert parse_tum(b"\xef\xbb\xbf0 1 2 3 0 0 0 1\n")[1].tolist() == [[1.0, 2.0, 3.0]]
    with pytest.raises(Fault, match=r"\(0,1,2,3\); give .* a file with column names ends in .csv"):
        parse_tum(b"0,1,2,3\n")
