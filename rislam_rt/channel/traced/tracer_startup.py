"""Start the tracer once, on the backend that `rislam_rt.tracer_backend` chose."""

from functools import cache
from importlib import import_module

from rislam_rt.tracer_backend import BackendInfo, prepare_backend, uninterrupted


@cache
def start_tracer() -> BackendInfo:
    """Start the tracer: set Mitsuba's variant and import Sionna RT (3 to 4 s the first time).

    Raises
    ------
    SetupError
        The machine lacks something that the tracer needs.
    """
    info = prepare_backend()
    with uninterrupted():
        import_module("mitsuba").set_variant(info.variant)
        import_module("sionna.rt")
    return info
