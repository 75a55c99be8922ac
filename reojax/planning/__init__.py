"""Any orientation: sequences of manoeuvres, and free paths, that end on a target (thesis 2.9)."""

from reojax.planning.farthest_turn import farthest_turn as farthest_turn
from reojax.planning.free_path import free_path as free_path, free_paths as free_paths
from reojax.planning.free_paths_result import FreePaths as FreePaths
from reojax.planning.plan import plan as plan, plan_many as plan_many, replan as replan
from reojax.planning.result import Plan as Plan
