"""Ray-traced channel: Sionna RT and Mitsuba on the room's meshes. The only folder that imports them, and late.

How a trajectory of K cycles becomes few solves:

- *legs*, not pairs: a landmark is a far end, all Tx and Rx positions are devices, and every cycle's paths are joined
  from its legs (`path_composition.py`); LOS and VT are legs from Tx k to Rx k. One row asks for one device, far end and
  wall sequence, so nothing is traced that no cycle needs.
- *candidates* (`wall_sequences.py`) are all wall sequences that the room's planes leave possible, at every position,
  instead of what randomly shot rays happen to meet. So the set is complete by construction, the same from run to run.
- *tracing* is Sionna's: its image method (`visibility.py`) mirrors in the meshes' planes and sends rays back through
  the scene, which decides visibility and the primitives met; its radio materials and antenna patterns say what becomes
  of the field (`fields.py`), which is carried along the path's own directions: Sionna's basis fails near the vertical.
- *refinement* (`path_geometry.py`) recomputes in float64, on the walls' planes, where the legs found run.
"""

from rislam_rt.channel.traced.channel import TracedChannel
from rislam_rt.channel.traced.diffuse_paths import DiffuseConfig, DiffuseKind
from rislam_rt.channel.traced.float32_limits import shortest_segment
from rislam_rt.channel.traced.self_test import trace_small_box
from rislam_rt.model import Antennas

__all__ = ["Antennas", "DiffuseConfig", "DiffuseKind", "TracedChannel", "shortest_segment", "trace_small_box"]
