"""Building materials of ITU-R P.2040: the constants of their permittivity, and the carriers they are specified for."""

from rislam_rt.errors import SceneError

ITU_MATERIALS: dict[str, tuple[tuple[float, float, float, float, float, float], ...]] = {
    "concrete": ((1.0, 100.0, 5.24, 0.0, 0.0462, 0.7822), (110.0, 330.0, 5.17, 0.0, 0.0145, 1.09)),
    "brick": ((1.0, 40.0, 3.91, 0.0, 0.0238, 0.16), (110.0, 330.0, 4.15, 0.0, 0.0006, 1.5712)),
    "plasterboard": ((1.0, 100.0, 2.73, 0.0, 0.0085, 0.9395), (110.0, 330.0, 2.56, 0.0, 0.0001, 1.7799)),
    "wood": ((0.001, 100.0, 1.99, 0.0, 0.0047, 1.0718), (110.0, 330.0, 1.82, 0.0, 0.004, 1.0761)),
    "glass": ((0.1, 100.0, 6.31, 0.0, 0.0036, 1.3394), (220.0, 450.0, 5.79, 0.0, 0.0004, 1.658)),
    "ceiling_board": ((1.0, 100.0, 1.48, 0.0, 0.0011, 1.075), (220.0, 450.0, 1.52, 0.0, 0.0029, 1.029)),
    "chipboard": ((1.0, 100.0, 2.58, 0.0, 0.0217, 0.78),),
    "plywood": ((1.0, 40.0, 2.71, 0.0, 0.33, 0.0),),
    "marble": ((1.0, 60.0, 7.074, 0.0, 0.0055, 0.9262),),
    "floorboard": ((50.0, 100.0, 3.66, 0.0, 0.0044, 1.3515),),
    "vinyl_tile": ((1.0, 40.0, 3.62, 0.0, 0.0051, 0.8422),),
    "carpet_tile": ((1.0, 40.0, 2.08, 0.0, 0.0009, 0.82),),
    "asphalt_concrete": ((1.0, 40.0, 4.83, 0.0, 0.0108, 1.3969),),
    "clear_acrylic": ((110.0, 330.0, 2.58, 0.0, 0.0001, 1.6524),),
    "metal": ((1.0, 100.0, 1.0, 0.0, 1e7, 0.0),),
    "very_dry_ground": ((1.0, 10.0, 3.0, 0.0, 0.00015, 2.52),),
    "medium_dry_ground": ((1.0, 10.0, 15.0, -0.1, 0.035, 1.63),),
    "wet_ground": ((1.0, 10.0, 30.0, -0.4, 0.15, 1.3),),
}
"""ITU-R P.2040-4, table 3: lowest and highest frequency [GHz] and constants a, b, c, d of each range."""


def itu_parameters(name: str, carrier: float) -> tuple[float, float, float, float]:
    """Constants a, b, c, d of an ITU-R P.2040 material at the carrier [Hz]: with f in GHz, the relative permittivity is
    `a f^b` and the conductivity `c f^d` [S/m].

    Raises
    ------
    SceneError
        The material is unknown, or not specified at the carrier.
    """
    if name not in ITU_MATERIALS:
        raise SceneError(f"material.itu: '{name}' received; give one of {', '.join(ITU_MATERIALS)}")
    ghz = carrier / 1e9
    for low, high, a, b, c, d in ITU_MATERIALS[name]:
        if low <= ghz <= high:
            return a, b, c, d
    ranges = " or ".join(f"{row[0]:g} to {row[1]:g} GHz" for row in ITU_MATERIALS[name])
    raise SceneError(f"material.itu: '{name}' at {ghz:g} GHz received; it is specified from {ranges}")
