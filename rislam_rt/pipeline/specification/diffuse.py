"""Settings of diffuse and diffracted paths, which no landmark explains: the table `[extras]` of a pipeline file."""

from typing import Annotated

from pydantic import Field

from rislam_rt.pipeline.specification.section import Section


class DiffuseSection(Section):
    """Which diffuse and diffracted paths the ray tracer adds to the received signal, unknown to the agent."""

    diffuse: bool = False
    """Whether rough walls scatter: those whose material has `scattering`, or all by `room.scattering`."""
    diffraction: bool = False
    """Whether edges of walls, objects and openings diffract."""
    depth: Annotated[int, Field(ge=1, le=3)] = 1
    """Largest number of interactions of a diffuse or diffracted path."""
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 2000
    """Rays shot in every cycle; the mean power does not depend on them, its fluctuation does."""

    @property
    def wanted(self) -> bool:
        """Whether diffuse or diffracted paths are to be traced."""
        return self.diffuse or self.diffraction
