"""Which kind of pipeline a file is."""

from collections.abc import Sequence
from pathlib import Path

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.pipeline.specification.read import build_spec, read_table
from rislam_rt.pipeline.specification.spec import PipelineSpec, build_design, build_settings
from rislam_rt.studies.classifier.spec import ClassifierSpec, build_receiver
from rislam_rt.studies.spec import ClaimsSpec, CompareSpec, Fig4aSpec
from rislam_rt.studies.swept import SWEPT, SweptSpec, check_swept
from rislam_rt.studies.unseen.spec import UnseenSpec

KINDS = ("slam", "compare_channels", "fig4a", *SWEPT, "unseen", "claims", "train_classifier")
"""What `kind` may say; `slam` if it is not there."""


AnySpec = PipelineSpec | CompareSpec | Fig4aSpec | SweptSpec | ClaimsSpec | ClassifierSpec


def load_any(path: str | Path, overrides: Sequence[str] = ()) -> AnySpec:
    """The specification of a file of any kind, `key=value` settings (dotted keys) put over it first.

    Raises
    ------
    ConfigError
        The file cannot be read or is not TOML; a key is unknown, a value of the wrong type or out of range. One line.
    """
    table = read_table(path, overrides)
    kind = table.content.get("kind", KINDS[0])
    if kind == "compare_channels":
        return build_spec(table, CompareSpec, lambda spec: build_radio(spec.radio))
    if kind == "fig4a":
        return build_spec(table, Fig4aSpec, lambda spec: (build_radio(spec.radio), build_design(spec.design)))
    if isinstance(kind, str) and kind in SWEPT:
        return build_spec(table, SWEPT[kind], check_swept)
    if kind == "unseen":
        return build_spec(table, UnseenSpec, check_swept)
    if kind == "train_classifier":
        return build_spec(table, ClassifierSpec, lambda spec: (build_radio(spec.radio), build_receiver(spec.receiver)))
    if kind == "claims":
        return build_spec(table, ClaimsSpec, lambda spec: None)
    if kind in KINDS:
        return build_spec(table, PipelineSpec, build_settings)
    source = "--set" if "kind" in table.changed else path
    raise ConfigError(f"{source}: kind: {str(kind)[:60]!r} received; give one of {', '.join(map(repr, KINDS))}")
