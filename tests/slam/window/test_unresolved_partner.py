"""Unresolved partners: heard or not, by where and how loud their component is."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.unresolved_partner import partner_clear, partner_presence

STD, LEVEL_STD = np.array([0.002, 0.004, 0.004]), 0.05
PLACE, GAP = np.array([4.0, 0.1, 0.2]), np.array([0.2, 0.1, -0.1])


def view_of(presence, *, partner=1, uncertain=0.0, clear=None):
    """Association of one component with a cluster of two returns, of which a map known within `uncertain` [m] tells the
    places; nothing occludes the partner with a probability `clear`, and if so it is heard."""
    slope = np.zeros((2, 3, 7))
    slope[0, 0, 0], slope[1, 0, 1] = 1.0, 1.0
    groups = SimpleNamespace(
        leader=np.array([0]), partner=np.array([partner]), presence=np.array([presence]), share=np.array([0.4]),
        share_variance=np.array([0.02]), gap=GAP[None], disturbance=np.zeros((1, 3)),
        log_amplitude=np.array([np.log(1.28)]), log_amplitude_std=np.array([0.3]),
    )  # fmt: skip
    expected = SimpleNamespace(
        seen=PLACE + np.array([np.zeros(3), GAP]), jacobian=slope,
        log_amplitude=np.array([0.0, -0.2]), log_amplitude_std=np.full(2, 0.2),
    )  # fmt: skip
    return SimpleNamespace(
        groups=groups, expected=expected, row=np.array([0]), pick=np.array([0]), scatter=np.ones(2),
        clear=np.array([0.9, presence if clear is None else clear]),
        covariance=uncertain**2 * np.eye(7),
    )  # fmt: skip


def heard_at(share, level=0.0):
    seen = (PLACE + share * GAP)[None]
    return SimpleNamespace(
        seen=seen, std=STD[None], log_amplitude=np.array([level]), log_amplitude_std=np.array([LEVEL_STD])
    )


def test_where_a_component_is_tells_whether_two_paths_are_in_it():
    assert partner_presence(view_of(0.5), heard_at(0.0))[0] < 1e-3
    assert partner_presence(view_of(0.5), heard_at(0.4, np.log(1.28)))[0] > 1.0 - 1e-9


@pytest.mark.parametrize("share", [0.0, 0.02, 0.2])
def test_it_is_the_ratio_of_two_densities(share):
    """Against multivariate normal densities by scipy: of the component's place, and of its log amplitude."""
    view, heard = view_of(0.3, uncertain=0.01), heard_at(share, 0.1)
    groups, expected = view.groups, view.expected
    both = expected.jacobian[0] + 0.4 * (expected.jacobian[1] - expected.jacobian[0])
    noise = np.diag(STD**2)
    wide = noise + np.diag(groups.share_variance[0] * GAP**2)
    level = LEVEL_STD**2 + (0.5 * CONSTANTS.fading) ** 2

    def log_density(place, slope, extra, mean, std):
        normal = scipy.stats.multivariate_normal(place, slope @ view.covariance @ slope.T + extra)
        return normal.logpdf(heard.seen[0]) + scipy.stats.norm(mean, np.sqrt(level + std**2)).logpdf(0.1)

    ratio = log_density(expected.seen[0] + 0.4 * GAP, both, wide, np.log(1.28), 0.3)
    ratio -= log_density(expected.seen[0], expected.jacobian[0], noise, 0.0, 0.2)
    now, later = partner_presence(view, heard), partner_clear(view, heard)
    assert scipy.special.logit(now[0]) == pytest.approx(scipy.special.logit(0.3) + ratio, rel=1e-6)
    slow = np.clip(ratio / CONSTANTS.memory, -CONSTANTS.max_log_ratio, CONSTANTS.max_log_ratio)
    assert scipy.special.logit(later[0]) == pytest.approx(scipy.special.logit(0.3) + slow, rel=1e-6)


def test_who_has_no_partner_hears_none():
    alone = view_of(0.0, partner=-1), heard_at(0.4)
    assert partner_presence(*alone)[0] == partner_clear(*alone)[0] == 0.0


@pytest.mark.parametrize("above", [1.0, 0.5, 0.0])
def test_what_is_below_the_plane_of_the_array_tells_nothing_of_occlusion(above):
    """By counting: a partner that is clear and above is heard; a component that it is not heard in is far likelier."""
    view, clear = view_of(0.8 * above, clear=0.8), 0.8
    heard = heard_at(0.0)
    slow = np.exp(-CONSTANTS.max_log_ratio)  # the component is so much likelier without the partner
    told = clear * (above * slow + 1.0 - above)
    expected = told / (told + 1.0 - clear)
    assert partner_clear(view, heard)[0] == pytest.approx(expected, rel=1e-9)
