"""The claims of the thesis's simulation sections, each with its verdict, worked out from measured numbers."""

from thesis.claim_table import LEFT_OUT, Claim
from thesis.drop_tower_claims import drop_tower_claims, torque_speed_claims


def judge(n: dict[str, float]) -> list[Claim]:
    """Judge every claim by the numbers of `measure.measure`."""
    parts = (
        _manoeuvres,
        _amplitudes,
        _end_links,
        _motors,
        _inertias,
        _symmetries,
        _small_amplitudes,
        _one_rectangle,
        torque_speed_claims,
        drop_tower_claims,
    )
    return [claim for part in parts for claim in part(n)]


def _manoeuvres(n: dict[str, float]) -> list[Claim]:
    six = n.get("six_body_deg")
    return [
        Claim(
            "2.4",
            "Only the path in joint space matters, not how fast it is run",
            "three time laws integrated in time",
            f"largest difference {n['time_law_rad']:.0e} rad",
            n["time_law_rad"] < 1e-7,
            "even, quintic and hurried; another integrator than `net_rotation`",
        ),
        Claim(
            "2.4",
            "Manoeuvre A turns the robot about its roll axis",
            "2.5",
            f"roll {n['a_roll_deg']:.1f}°, off-axis {n['a_tip_deg']:.1f}°",
            n["a_tip_deg"] < 0.05 * n["a_roll_deg"],
            "",
        ),
        Claim(
            "2.4",
            "Manoeuvre B, a distal joint reversed, turns it mainly about yaw, and less",
            "2.6",
            f"yaw {n['b_yaw_deg']:.1f}°, off-axis {n['b_tip_deg']:.1f}°; {n['b_to_a']:.2f} of A's roll",
            n["b_tip_deg"] < 0.05 * abs(n["b_yaw_deg"]) and n["b_to_a"] < 0.5,
            "",
        ),
        Claim(
            "1.4, 2.4",
            "Six links with folding feet do the same A as four with fixed L-shaped ends",
            "A on `six_body`",
            "" if six is None else f"angle {six:.6f}° and {n['four_body_deg']:.6f}°",
            None if six is None else abs(six - n["four_body_deg"]) < 1e-6,
            LEFT_OUT
            if six is None
            else "the same mechanism from another base link: a conjugate rotation, the same angle",
        ),
        Claim(
            "2.9",
            "A and B in sequence with varying amplitudes reach any orientation",
            f"A, up to four Bs, A; {n['targets']:.0f} random targets",
            f"{n['any_within_3_deg']:.0%} within 3°, the worst {n['any_worst_deg']:.1f}°",
            n["any_within_3_deg"] == 1,
            "amplitudes from a grid, so not exactly; continuous ones close the gap",
        ),
    ]


def _amplitudes(n: dict[str, float]) -> list[Claim]:
    return [
        Claim(
            "2.7, fig 1.5, 2.7",
            "A at 270°/120° turns the robot by about 180°",
            "2.7",
            f"roll {n['a_roll_deg']:.1f}°",
            abs(n["a_roll_deg"] - 180) < 12,
            "the prototype's unpublished numbers were fitted to this",
        ),
        Claim(
            "2.7, fig 1.5, 2.7",
            "A's axis hardly varies with the amplitudes",
            "2.7",
            f"axes within {n['a_axis_spread_deg']:.1f}° of their mean",
            n["a_axis_spread_deg"] < 10,
            "",
        ),
        Claim(
            "2.7, fig 1.5, 2.7",
            "A's angle grows smoothly with both amplitudes",
            "2.7",
            f"every step on the thesis's grid is up, by {n['a_least_step_deg']:.1f}° or more; steepest slope "
            f"{n['a_steepest_over_mean_slope']:.1f} times the mean one",
            n["a_least_step_deg"] > 0 and n["a_steepest_over_mean_slope"] < 4 and n["a_lowest_roll_deg"] > -1,
            f"on the fine grid it first dips, to {n['a_lowest_roll_deg']:.1f}°, at bends up to "
            f"{n['a_negative_up_to_bend_deg']:.0f}°",
        ),
        Claim(
            "fig 2.10",
            "B's turn is mainly yaw at all amplitudes",
            "2.10",
            f"off-axis at most {n['b_largest_off_axis_share']:.1%} of the yaw",
            n["b_largest_off_axis_share"] < 0.1,
            "",
        ),
    ]


def _end_links(n: dict[str, float]) -> list[Claim]:
    return [
        Claim(
            "2.7, fig 2.8",
            "More end link inertia helps up to about 100 kg mm²",
            "2.8",
            f"roll {n['end_roll_at_10_deg']:.1f}° at 10 to {n['end_roll_at_100_deg']:.1f}° at 100; peak at "
            f"{n['end_peak_kg_mm2']:.0f}",
            n["end_gain_least_step_deg"] > 0 and 80 <= n["end_peak_kg_mm2"] <= 130,
            "the prototype's unpublished numbers were fitted to the place of the peak",
        ),
        Claim(
            "2.7, fig 2.8",
            "Past that there is less net roll",
            "2.8",
            f"{n['end_roll_at_100_deg']:.1f}° at 100, {n['end_roll_at_190_deg']:.1f}° at 190",
            n["end_loss_least_step_deg"] > 0,
            "",
        ),
        Claim(
            "2.7, fig 2.8",
            "Past that there is more off-axis rotation",
            "2.8",
            f"{n['end_tip_at_100_deg']:.1f}° at 100, {n['end_tip_at_190_deg']:.1f}° at 190",
            n["end_tip_least_step_deg"] > 0,
            "",
        ),
    ]


def _motors(n: dict[str, float]) -> list[Claim]:
    return [
        Claim(
            "2.7, fig 2.9",
            "A higher gear ratio increases the net rotation",
            "2.9",
            f"every step up, by {n['gear_least_step_deg']:.2f}° or more; {n['motor_least_deg']:.1f}° to "
            f"{n['motor_most_deg']:.1f}° over the grid",
            n["gear_least_step_deg"] > 0,
            "",
        ),
        Claim(
            "2.7, fig 2.9",
            "A larger rotor inertia increases the net rotation",
            "2.9",
            f"every step up, by {n['rotor_least_step_deg']:.2f}° or more",
            n["rotor_least_step_deg"] > 0,
            "only ratio times inertia counts",
        ),
    ]


def _inertias(n: dict[str, float]) -> list[Claim]:
    return [
        Claim(
            "2.7.2",
            "Middle links whose inertia grows without bound end in no reorientation",
            "inertia times 1 to 1e6",
            f"{n['middle_last_deg']:.4f}° at 1e6; angle grows as inertia^{n['middle_slope']:.2f}",
            n["middle_last_deg"] < 0.01 and abs(n["middle_slope"] + 1) < 0.1,
            "",
        ),
        Claim(
            "fig 2.8, 2.9",
            "The end links' nominal inertia is on both grids: 700 rotors",
            "the built-in numbers",
            f"{n['nominal_inertia_kg_mm2']:.0f} kg mm² built in, {n['from_grids_kg_mm2']:.0f} from the grids",
            abs(n["nominal_inertia_kg_mm2"] - n["from_grids_kg_mm2"]) < 1e-6,
            "",
        ),
    ]


def _symmetries(n: dict[str, float]) -> list[Claim]:
    return [
        Claim(
            "2.4",
            "A retraced path gives no rotation, a path run backwards the inverse",
            "bend, twist, untwist, unbend; A backwards",
            f"{n['retraced_deg']:.0e}° and {n['reversed_deg']:.0e}°",
            max(n["retraced_deg"], n["reversed_deg"]) < 1e-7,
            "",
        ),
        Claim(
            "2.5",
            "Masses and inertias scaled together, or lengths with inertias, change nothing",
            "times 3; times 2 and 4",
            f"{n['scaled_mass_deg']:.0e}° and {n['scaled_length_deg']:.0e}°",
            max(n["scaled_mass_deg"], n["scaled_length_deg"]) < 1e-7,
            "",
        ),
        Claim(
            "2.4",
            "A is pure roll on a robot that is its own mirror image",
            "prototype, ends mirrored, no centre rotor",
            f"roll {n['mirrored_a_deg']:.1f}°, off-axis {n['mirrored_a_off_axis_deg']:.0e}°",
            n["mirrored_a_off_axis_deg"] < 1e-7 < n["mirrored_a_deg"],
            "",
        ),
        Claim(
            "2.4",
            "B is pure yaw on a robot that a half turn about the bisector maps onto itself",
            "prototype, no centre rotor",
            f"yaw {n['half_turn_b_deg']:.1f}°, off-axis {n['half_turn_b_off_axis_deg']:.0e}°",
            n["half_turn_b_off_axis_deg"] < 1e-7 < n["half_turn_b_deg"],
            "so B's off-axis part comes from the centre rotor alone",
        ),
    ]


def _small_amplitudes(n: dict[str, float]) -> list[Claim]:
    return [
        Claim(
            "2.7",
            "Small amplitudes: A grows as twist × bend²",
            "1° and 2°, prototype",
            f"twist^{n['a_power_of_twist']:.2f} bend^{n['a_power_of_bend']:.2f}",
            _near(n["a_power_of_twist"], 1) and _near(n["a_power_of_bend"], 2),
            "bend² needs ends to which both ways of bending are alike; with feet on one side a part linear in bend is "
            "left, and at a degree it leads",
        ),
        Claim(
            "2.7",
            "Small amplitudes: A grows as twist × bend², ends without feet",
            "1° and 2°, `two_cylinder_cat`",
            f"twist^{n['cat_a_power_of_twist']:.2f} bend^{n['cat_a_power_of_bend']:.2f}",
            _near(n["cat_a_power_of_twist"], 1) and _near(n["cat_a_power_of_bend"], 2),
            "",
        ),
        Claim(
            "2.7",
            "Small amplitudes: B grows as twist × bend",
            "1° and 2°, prototype",
            f"twist^{n['b_power_of_twist']:.2f} bend^{n['b_power_of_bend']:.2f}",
            _near(n["b_power_of_twist"], 1) and _near(n["b_power_of_bend"], 1),
            "",
        ),
    ]


def _one_rectangle(n: dict[str, float]) -> list[Claim]:
    thin = n.get("one_rectangle_within_3_deg")
    return [
        Claim(
            "2.9",
            "One rectangle with free amplitudes reaches only a thin part of all orientations, some 2 % within 3°",
            "38 × 17 × 38 rectangles, 2000 targets",
            "" if thin is None else f"{thin:.1%} within 3°",
            None if thin is None else thin < 0.04,
            LEFT_OUT if thin is None else "from below: a finer grid finds more",
        ),
    ]


def _near(power: float, wanted: int) -> bool:
    return abs(power - wanted) < 0.05
