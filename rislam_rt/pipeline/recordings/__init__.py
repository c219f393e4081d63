"""Recordings of an estimator's inputs, as arrays and as files, and estimates of pose and map from them."""

from rislam_rt.pipeline.recordings.inputs import Inputs, dataset_to_inputs
from rislam_rt.pipeline.recordings.own_measurements import inputs_of, localise, read_inputs
from rislam_rt.pipeline.recordings.replay import answers_from_arrays, replay

__all__ = ["Inputs", "answers_from_arrays", "dataset_to_inputs", "inputs_of", "localise", "read_inputs", "replay"]
