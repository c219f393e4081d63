"""Kinds of pipeline files: the specification of each, and reading a file of any kind."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_design, build_receiver, build_settings
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.pipeline.specification.read_pipeline import build_spec, read_table
from rislam_rt.studies.classifier.spec import ClassifierSpec
from rislam_rt.studies.spec import ClaimsSpec, CompareSpec, Fig4aSpec
from rislam_rt.studies.swept import SWEPT, SweptSpec, check_swept
from rislam_rt.studies.unseen.spec import UnseenSpec

AnySpec = PipelineSpec | CompareSpec | Fig4aSpec | SweptSpec | ClaimsSpec | ClassifierSpec

MAIN_KIND = "slam"
"""Kind of a pipeline file that does not state one: a SLAM run."""
KINDS: Mapping[str, tuple[type[AnySpec], Callable[[Any], object]]] = {
    MAIN_KIND: (PipelineSpec, build_settings),
    "compare_channels": (CompareSpec, lambda spec: build_radio(spec.radio)),
    "fig4a": (Fig4aSpec, lambda spec: (build_radio(spec.radio), build_design(spec.design))),
    **{kind: (study, check_swept) for kind, study in SWEPT.items()},
    "unseen": (UnseenSpec, check_swept),
    "claims": (ClaimsSpec, lambda spec: None),
    "train_classifier": (ClassifierSpec, lambda spec: (build_radio(spec.radio), build_receiver(spec.receiver))),
}
"""For each `kind` of a pipeline file, its specification and a check of the settings in SI units."""


def load_any(path: str | Path, overrides: Sequence[str] = ()) -> AnySpec:
    """Read a pipeline file of any kind as a specification, with `key=value` settings (dotted keys) put over it first.

    Raises
    ------
    ConfigError
        The file cannot be read or is not TOML; a key is unknown, a value of the wrong type or out of range. One line.
    """
    table = read_table(path, overrides)
    kind = table.content.get("kind", MAIN_KIND)
    if not isinstance(kind, str) or kind not in KINDS:
        source = "--set" if "kind" in table.changed else path
        raise ConfigError(f"{source}: kind: {str(kind)[:60]!r} received; give one of {', '.join(map(repr, KINDS))}")
    model, check = KINDS[kind]
    keys = set(table.content)
    if "kind" not in keys and not keys <= set(model.model_fields):
        others = [repr(name) for name, (study, _) in KINDS.items() if keys <= set(study.model_fields)]
        if others:
            raise ConfigError(f"{path}: kind: missing; with these keys, give {' or '.join(others)}")
    return build_spec(table, model, check)
