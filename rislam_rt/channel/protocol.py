"""Protocol of a channel: paths of a room over a trajectory, and their gains under any panel code."""

from typing import Protocol

from rislam_rt.model import Paths, RadioConfig, RisCode, Scene, Trajectory


class Channel(Protocol):
    """Protocol for all paths of a room: `TracedChannel` and `ImageSourceChannel` are drop-in for each other."""

    @property
    def scene(self) -> Scene:
        """The room whose paths a channel computes."""
        ...

    @property
    def radio(self) -> RadioConfig:
        """The radio of a channel, which decides carrier and antenna gains."""
        ...

    @property
    def depth(self) -> int:
        """Largest number of wall bounces on a path of a channel, both legs together."""
        ...

    def paths(self, trajectory: Trajectory) -> Paths:
        """Propagation paths by a channel in every cycle of a trajectory, with the panel's code at level 0."""
        ...

    def respond(self, paths: Paths, code: RisCode) -> Paths:
        """A channel's same paths with their gains under another panel code, without tracing again."""
        ...
