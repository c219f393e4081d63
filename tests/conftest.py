"""What every process that tests does once."""

import gc


def pytest_collection_finish() -> None:
    """What is loaded by now stays to the end: the collector of garbage is not to go through it again and again."""
    gc.collect()
    gc.freeze()
