"""The protocol of a channel: what every one offers."""

from typing import Protocol

from rislam_rt.model import Paths, RadioConfig, RisCode, Scene, Trajectory


class Channel(Protocol):
    """All paths of a room over a trajectory. `TracedChannel` and `ImageSourceChannel` are drop-in for each other."""

    @property
    def scene(self) -> Scene:
        """The room of a channel."""
        ...

    @property
    def radio(self) -> RadioConfig:
        """The agent's radio in a channel."""
        ...

    @property
    def depth(self) -> int:
        """Largest number of wall bounces on a path, both legs together."""
        ...

    def paths(self, trajectory: Trajectory) -> Paths:
        """What every channel gives: every path of every cycle, with the panel at level 0."""
        ...

    def respond(self, paths: Paths, code: RisCode) -> Paths:
        """What every channel gives: the same paths under another code, without tracing again."""
        ...
