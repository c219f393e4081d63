"""Delay spread over a RIS panel: what a path of no single delay costs, which the model of a panel leaves out."""

import numpy as np

SPREAD = "delays over the panel spread by up to"
"""First words of every remark on the delay spread of a panel."""


def band_loss_db(cells: float) -> float:
    """Loss [dB] over the band of a beam aimed at the carrier by a panel over which delays spread by T, so many
    resolution cells 1 / B.

    The mean of sinc(f T) over the tones f, which a receiver sums that takes the path for one delay: Si(x) / x at
    x = pi B T / 2, delays being spread evenly.
    """
    from scipy.special import sici

    x = 0.5 * np.pi * cells
    return float(20.0 * np.log10(x / sici(x)[0]))


def delay_spread_remark(spread: float, bandwidth: float) -> tuple[str, str]:
    """What is to be said of a delay spread [s] over a panel beyond 1 / B: what it costs, and when to mend it."""
    limit, loss = 1e9 / bandwidth, band_loss_db(spread * bandwidth)
    return (
        f"{SPREAD} {spread * 1e9:.3g} ns, more than 1 / B = {limit:.3g} ns: over the band "
        f"a real panel loses up to {loss:.2g} dB of an aimed code's gain, which the model, one delay for all elements, "
        "leaves out",
        "keep its size where it is too weak (twice the side is 12 dB, and the band takes less); else take a smaller "
        "panel or a smaller bandwidth",
    )
