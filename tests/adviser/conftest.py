"""The link budget, averaged over fewer random codes: no test looks closer at what random codes give."""

from collections.abc import Iterator

import pytest

from rislam_rt.adviser import forecast_codes


@pytest.fixture(scope="module", autouse=True)
def few_random_codes() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(forecast_codes, "RANDOM_CODES", 2)
        yield
