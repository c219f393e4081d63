"""Diffuse and diffracted paths, heard beside those that have an identity: the table `[extras]` of a pipeline file."""

from typing import Annotated

from pydantic import Field

from rislam_rt.pipeline.specification.section import Section


class DiffuseSection(Section):
    """Paths that last for no two cycles, found by the tracer and heard with all else; the agent is told of none."""

    diffuse: bool = False
    """What rough walls scatter: those whose material has `scattering`, or all by `room.scattering`."""
    diffraction: bool = False
    """What edges bend: of walls, of objects, of openings."""
    depth: Annotated[int, Field(ge=1, le=3)] = 1
    """Most interactions of such a path."""
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 2000
    """Rays shot in every cycle; power does not depend on them, its grain does."""

    @property
    def wanted(self) -> bool:
        """Whether diffuse or diffracted paths are wanted."""
        return self.diffuse or self.diffraction
