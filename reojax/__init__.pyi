"""The public names: read by type checkers, and by `__init__.py`, which imports each at its first use."""

from reojax import design, plot, robots, so3
from reojax.capsules import Capsule
from reojax.captures.calibration import Calibration, calibrate
from reojax.captures.capture import Capture, make_capture, read_capture
from reojax.captures.comparison import Comparison, Sampled, compare, joints_simulated
from reojax.captures.parameters import Parameter
from reojax.collision.clearance import clearance
from reojax.collision.nearest import Nearest, nearest_parts
from reojax.collision.path_clearance import PathClearance, path_clearance
from reojax.files.trajectories import write_trajectory
from reojax.manoeuvres import FOUR_BODY, SIX_BODY, Layout, manoeuvre_a, manoeuvre_b
from reojax.mechanics.certificate import Certificate, certify
from reojax.mechanics.controllable import ControllableDirections, controllable_directions
from reojax.mechanics.curvature import curvature
from reojax.mechanics.dynamics import (
    base_velocity,
    forward_dynamics,
    inverse_dynamics,
    joint_inertia,
    kinetic_energy,
)
from reojax.mechanics.holonomy import net_rotation, rotation_history
from reojax.mechanics.kinematics import LinkPoses, centre_of_mass, link_poses
from reojax.mechanics.momentum import MomentumMatrices, angular_momentum, connection, momentum_matrices
from reojax.models.json_file import save_robot
from reojax.models.load import load_robot
from reojax.models.mjcf_writer import write_mjcf
from reojax.motion.closed_loop import Tracking, track
from reojax.motion.fastest import Fastest, fastest_loop, free_law, overlap
from reojax.motion.least_time import LeastTime, minimum_stretch, minimum_time
from reojax.motion.motor import RE_MAX_17, Motor, no_load_speed, stall_torque, with_motors
from reojax.motion.pid import Gains, gains
from reojax.motion.release import Release, Released, released
from reojax.motion.release_spread import ReleaseSpread, release_spread
from reojax.motion.simulation import Motion, simulate
from reojax.motion.time_laws import Law, minimum_jerk, quintic, trapezoid
from reojax.motion.trajectory import Trajectory, along, through
from reojax.motion.trajectory_clearance import TrajectoryClearance, trajectory_clearance
from reojax.path import Path, joint_travel, polygon
from reojax.planning.farthest_turn import farthest_turn
from reojax.planning.free_path import free_path, free_paths
from reojax.planning.free_paths_result import FreePaths
from reojax.planning.plan import plan, plan_many, replan
from reojax.planning.plan_file import SavedPlan, load_plan, save_plan
from reojax.planning.result import Plan
from reojax.robot import Robot, layout_of, make_robot
from reojax.session import CompilationCache, cache
from reojax.steering.feedback import Steering as Steering
from reojax.steering.for_all import RightingForAll as RightingForAll, righting_for_all as righting_for_all
from reojax.steering.gains import CorrectionGains as CorrectionGains, correction_gains as correction_gains
from reojax.steering.lookup import RightingTable as RightingTable, righting_table as righting_table
from reojax.steering.readings import Reading as Reading, References as References
from reojax.steering.result import Righting as Righting
from reojax.steering.righting import righting as righting, righting_many as righting_many
from reojax.steering.tables import write_gains as write_gains
from reojax.sweeps.grid import zipped
from reojax.sweeps.merge import merge
from reojax.sweeps.result import BadDesign, Sweep
from reojax.sweeps.sweep import sweep
from reojax.viewer.html import view

__all__ = [
    "along",
    "angular_momentum",
    "BadDesign",
    "base_velocity",
    "cache",
    "calibrate",
    "Calibration",
    "Capsule",
    "Capture",
    "centre_of_mass",
    "Certificate",
    "certify",
    "compare",
    "clearance",
    "Comparison",
    "CompilationCache",
    "connection",
    "controllable_directions",
    "ControllableDirections",
    "correction_gains",
    "CorrectionGains",
    "curvature",
    "design",
    "farthest_turn",
    "Fastest",
    "fastest_loop",
    "forward_dynamics",
    "FOUR_BODY",
    "free_law",
    "free_path",
    "free_paths",
    "FreePaths",
    "Gains",
    "gains",
    "inverse_dynamics",
    "joint_inertia",
    "joint_travel",
    "joints_simulated",
    "kinetic_energy",
    "Law",
    "Layout",
    "layout_of",
    "LeastTime",
    "load_plan",
    "link_poses",
    "LinkPoses",
    "load_robot",
    "make_capture",
    "make_robot",
    "manoeuvre_a",
    "manoeuvre_b",
    "merge",
    "minimum_jerk",
    "minimum_stretch",
    "minimum_time",
    "momentum_matrices",
    "MomentumMatrices",
    "Motion",
    "Motor",
    "Nearest",
    "nearest_parts",
    "net_rotation",
    "no_load_speed",
    "overlap",
    "Parameter",
    "Path",
    "path_clearance",
    "PathClearance",
    "Plan",
    "plan",
    "plan_many",
    "plot",
    "polygon",
    "quintic",
    "RE_MAX_17",
    "read_capture",
    "Release",
    "Reading",
    "References",
    "release_spread",
    "Released",
    "released",
    "ReleaseSpread",
    "replan",
    "righting",
    "Righting",
    "RightingTable",
    "RightingForAll",
    "righting_for_all",
    "righting_many",
    "righting_table",
    "Robot",
    "robots",
    "rotation_history",
    "save_plan",
    "SavedPlan",
    "Sampled",
    "simulate",
    "save_robot",
    "SIX_BODY",
    "so3",
    "stall_torque",
    "Steering",
    "Sweep",
    "sweep",
    "through",
    "track",
    "Tracking",
    "Trajectory",
    "TrajectoryClearance",
    "trajectory_clearance",
    "trapezoid",
    "view",
    "with_motors",
    "write_gains",
    "write_mjcf",
    "write_trajectory",
    "zipped",
]
