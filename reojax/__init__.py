"""reojax: how a robot in free fall turns itself with its own joints, differentiably, in JAX."""

from reojax import design as design, robots as robots, so3 as so3
from reojax.calibrate import Calibration as Calibration, calibrate as calibrate
from reojax.capture import Capture as Capture, make_capture as make_capture, read_capture as read_capture
from reojax.certificate import Certificate as Certificate, certify as certify
from reojax.comparison import Comparison as Comparison, compare as compare, joints_simulated as joints_simulated
from reojax.control import Gains as Gains, Tracking as Tracking, track as track
from reojax.curvature import curvature as curvature
from reojax.dynamics import (
    base_velocity as base_velocity,
    forward_dynamics as forward_dynamics,
    inverse_dynamics as inverse_dynamics,
    joint_inertia as joint_inertia,
    kinetic_energy as kinetic_energy,
)
from reojax.export import write_trajectory as write_trajectory
from reojax.fastest import (
    Fastest as Fastest,
    fastest_loop as fastest_loop,
    free_law as free_law,
    overlap as overlap,
)
from reojax.holonomy import net_rotation as net_rotation, rotation_history as rotation_history
from reojax.manoeuvres import (
    FOUR_BODY as FOUR_BODY,
    SIX_BODY as SIX_BODY,
    Layout as Layout,
    manoeuvre_a as manoeuvre_a,
    manoeuvre_b as manoeuvre_b,
)
from reojax.minimum_time import LeastTime as LeastTime, minimum_time as minimum_time
from reojax.momentum import (
    angular_momentum as angular_momentum,
    connection as connection,
    momentum_matrices as momentum_matrices,
)
from reojax.motion import Motion as Motion, simulate as simulate
from reojax.motor import RE_MAX_17 as RE_MAX_17, Motor as Motor, with_motors as with_motors
from reojax.path import Path as Path, joint_travel as joint_travel, polygon as polygon
from reojax.plan import (
    FreePaths as FreePaths,
    Plan as Plan,
    free_path as free_path,
    free_paths as free_paths,
    plan as plan,
    plan_many as plan_many,
    replan as replan,
)
from reojax.release import (
    Release as Release,
    Released as Released,
    ReleaseSpread as ReleaseSpread,
    release_spread as release_spread,
    released as released,
)
from reojax.robot import Robot as Robot, make_robot as make_robot
from reojax.sweep import Sweep as Sweep, sweep as sweep, zipped as zipped
from reojax.time_law import (
    Law as Law,
    minimum_jerk as minimum_jerk,
    quintic as quintic,
    trapezoid as trapezoid,
)
from reojax.trajectory import Trajectory as Trajectory, along as along, through as through
