"""What one fixed step of the fast engine makes of dry friction, play, contact and memory.

Compiled scalar functions. The forces of a step are taken at its middle and held, so that each
law here has a closed form over the step: a body under a constant push and dry friction slows
down, stops within the step and stays or turns round; two bodies with play between them fly,
meet, part once and go on together; stops (Jenkins elements) and Maxwell branches follow
a given piece of motion. Every law depends on the motion alone where it is rate independent.

Sources: Moreau and Jean's time stepping of set-valued friction (Acary and Brogliato, Numerical
Methods for Nonsmooth Dynamical Systems, Springer 2008, ch. 10), with the stop located inside
the step, which keeps it second order; stops: Iwan, J. Appl. Mech. 33 (1966) 893; Bouc-Wen:
Wen, J. Eng. Mech. Div. 102 (1976) 249.
"""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e

# the full state of the fast engine; everything on the output side of the gear
CURRENT, WHEEL, WHEEL_SPEED, LOAD, LOAD_SPEED = range(5)
OUTPUT, OUTPUT_SPEED = 5, 6  # of the wheel behind the play; equal to the wheel without play
LINK, LINK_SPEED = 7, 8  # of what lies beyond the flexibility of the link
WINDING_RISE, CASE_RISE = 9, 10  # [K] above ambient
GEAR_STRETCH, LOAD_STRETCH = 11, 12  # of the stops of presliding friction [rad]
SLIP = 13  # stretches of the Maxwell-slip stops [rad]
BOUC_WEN_STRETCH = SLIP + e.N_SLIPS
BRANCH = BOUC_WEN_STRETCH + 1  # stretches of the Maxwell branches [rad]
N_STEP_STATES = BRANCH + e.N_BRANCHES
STATE_NAMES = (
    "current_A",
    "wheel_angle_rad",
    "wheel_velocity_rad_per_s",
    "load_angle_rad",
    "load_velocity_rad_per_s",
    "output_angle_rad",
    "output_velocity_rad_per_s",
    "link_angle_rad",
    "link_velocity_rad_per_s",
    "winding_rise_K",
    "case_rise_K",
    "gear_stretch_rad",
    "load_stretch_rad",
    *(f"slip_stretch_{k + 1}_rad" for k in range(e.N_SLIPS)),
    "bouc_wen_stretch_rad",
    *(f"branch_stretch_{k + 1}_rad" for k in range(e.N_BRANCHES)),
)
N_GAINS = 2 * e.N_BRANCHES
BOUC_WEN_PIECE, MOST_PIECES = 0.5, 10_000  # of a yield over the exponent: stable up to 2
MAX_PLAY_PIECES = 8  # of a step, between meetings of the flanks


@njit(error_model="numpy")
def clip(value, limit):
    """The value kept within -limit..limit."""
    return min(max(value, -limit), limit)


@njit(error_model="numpy")
def slid(inertia, drag, push, speed, h):
    """Speed after h under a constant push and a drag proportional to the mean speed."""
    half = 0.5 * h * drag
    return ((inertia - half) * speed + h * push) / (inertia + half)


@njit(error_model="numpy")
def dry_move(inertia, drag, push, forward, backward, hold_forward, hold_backward, speed, h):
    """A body under a constant push with dry friction: (speed, way travelled) after h.

    `forward`, `backward` are the friction levels of sliding, `hold_*` those of breaking away.
    A body that stops within h stays there (its speed is exactly zero) or turns round.
    """
    way = 0.0
    if speed > 0.0:
        way = 1.0
    elif speed < 0.0:
        way = -1.0
    elif push > hold_forward:
        way = 1.0
    elif push < -hold_backward:
        way = -1.0
    if way == 0.0:
        return 0.0, 0.0
    level = forward if way > 0.0 else backward
    after = slid(inertia, drag, push - way * level, speed, h)
    if way * after >= 0.0:
        return after, 0.5 * h * (speed + after)
    if speed == 0.0:  # the sliding level is above the push: it has not moved
        return 0.0, 0.0
    stop = h * speed / (speed - after)
    travelled, rest = 0.5 * stop * speed, h - stop
    after = 0.0
    if push > hold_forward:
        after = max(slid(inertia, drag, push - forward, 0.0, rest), 0.0)
    elif push < -hold_backward:
        after = min(slid(inertia, drag, push + backward, 0.0, rest), 0.0)
    return after, travelled + 0.5 * rest * after


@njit(error_model="numpy")
def presliding_move(inertia, drag, push, dry, level, stiffness, yield_, stretch, speed, h):
    """A body held by a stop in parallel to dry friction after h: (speed, way, stretch).

    The stop's torque is stiffness * stretch until it yields, then `level`; its mean over the
    step is taken by the trapezoidal rule and implicit, so that a stiff stop needs no short step.
    `dry` is the set-valued rest.
    """
    elastic = push - stiffness * stretch
    way = 1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0
    if way == 0.0:
        if abs(elastic) <= dry:
            return 0.0, 0.0, stretch
        way = 1.0 if elastic > 0.0 else -1.0
    half, spring = 0.5 * h * drag, 0.25 * h * h * stiffness
    after = (inertia - half - spring) * speed + h * (elastic - way * dry)
    after /= inertia + half + spring
    passed = 0.5 * h * (speed + after)
    middle = stretch + 0.5 * passed
    if abs(middle) > yield_:
        side = 1.0 if middle > 0.0 else -1.0
        after = slid(inertia, drag, push - way * dry - side * level, speed, h)
        passed = 0.5 * h * (speed + after)
    if dry > 0.0 and way * after < 0.0:
        # it stops within the step, and goes back only if the stop and the push overcome `dry`
        stop = h * speed / (speed - after) if speed != 0.0 else 0.0
        passed, rest = 0.5 * stop * speed, h - stop
        elastic = push - stiffness * clip(stretch + passed, yield_)
        after = 0.0
        if abs(elastic) > dry:
            back = dry if elastic > 0.0 else -dry
            after = (elastic - back) * rest / (inertia + 0.25 * rest * rest * stiffness)
        passed += 0.5 * rest * after
    return after, passed, clip(stretch + passed, yield_)


@njit(error_model="numpy")
def bristle_move(inertia, drag, push, dry, level, stiffness, stretch, speed, h):
    """A body held by bristles in parallel to dry friction after h: (speed, way, stretch).

    The bristles' stretch z follows dz/dx = 1 - sgn(dx) z stiffness / level and pushes with
    stiffness * z (LuGre: Canudas de Wit et al., IEEE TAC 40 (1995) 419, its micro-damping in
    `drag`, see `bending`; at one level Dahl's). z over a way is the exact exponential; its mean
    over the step is implicit.
    """
    elastic = push - stiffness * stretch
    way = 1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0
    if way == 0.0:
        if abs(elastic) <= dry:
            return 0.0, 0.0, stretch
        way = 1.0 if elastic > 0.0 else -1.0
    if level <= 0.0:
        after, passed = dry_move(inertia, drag, push, dry, dry, dry, dry, speed, h)
        return after, passed, 0.0
    steady, half = level / stiffness, 0.5 * h * drag
    passed, after = h * speed, speed
    tangent = stiffness * (1.0 - way * stretch / steady)
    for _ in range(2):
        r = abs(passed) / steady
        curve = 1.0 - r / 3.0
        if r > 1e-3:
            curve = 2.0 * (1.0 - (1.0 - np.exp(-r)) / r) / r
        spring = 0.25 * h * h * tangent * curve
        if spring >= 0.0:
            after = (inertia - half - spring) * speed + h * (elastic - way * dry)
            after /= inertia + half + spring
        else:  # the bristles give way: what they lose in the step is taken as it was foreseen
            loss = 0.5 * tangent * curve * passed
            after = slid(inertia, drag, elastic - loss - way * dry, speed, h)
        passed = 0.5 * h * (speed + after)
    if dry > 0.0 and way * after < 0.0:
        passed = 0.5 * h * speed * speed / (speed - after) if speed != 0.0 else 0.0
        after = 0.0
    end = steady if passed > 0.0 else -steady
    return after, passed, end + (stretch - end) * np.exp(-abs(passed) / steady)


@njit(error_model="numpy")
def bending(friction, stretch, way):
    """Share of a body's way by which its bristles bend: one at rest, none where all slide.

    Their micro-damping (LuGre's sigma_1) acts on this share alone. `way` is what is foreseen of a
    step: one that turns back bends them within a step or two, and the share at the step's begin
    would be kept too long.
    """
    level, stiffness = friction[4], friction[5]
    if level <= 0.0:
        return 0.0
    side = 1.0 if way > 0.0 else -1.0 if way < 0.0 else 0.0
    share = max(0.0, 1.0 - side * stretch * stiffness / level)
    r = abs(way) * stiffness / level
    return share * ((1.0 - np.exp(-r)) / r if r > 1e-6 else 1.0)


@njit(error_model="numpy")
def move(inertia, drag, push, friction, stretch, speed, h):
    """A body after h under whatever dry friction it has: (speed, way, stretch).

    `friction` is (sliding level forward, backward, holding level forward, backward, sliding
    level of the presliding stop, its stiffness, its yield stretch); zeros are no friction, a
    yield stretch below zero are bristles.
    """
    forward, backward, hold_forward, hold_backward, level, stiffness, yield_ = friction
    if yield_ != 0.0:
        dry = forward if speed > 0.0 or (speed == 0.0 and push > 0.0) else backward
        if yield_ < 0.0:
            return bristle_move(inertia, drag, push, dry, level, stiffness, stretch, speed, h)
        return presliding_move(
            inertia, drag, push, dry, level, stiffness, yield_, stretch, speed, h
        )
    if hold_forward == 0.0 and hold_backward == 0.0:
        after = slid(inertia, drag, push, speed, h)
        return after, 0.5 * h * (speed + after), stretch
    after, way = dry_move(
        inertia, drag, push, forward, backward, hold_forward, hold_backward, speed, h
    )
    return after, way, stretch


@njit(error_model="numpy")
def lossy_move(front, near, drag, load_drag, shaft, load_shaft, losses, friction, speed, h):
    """Motor and load on one rigid shaft with a lossy gear in between: (speed, way, joint torque).

    The gear's friction is loss |joint| against the motion, and joint = near a - load_shaft: both
    depend on the acceleration. Where the motor drives the load the friction is losses[0] joint,
    where the load drives -losses[1] joint, so that load and its inertia just count 1 + c times,
    c = losses[0] or -losses[1], whichever fits the sign of the joint's torque. A gear whose load
    would have to pull itself (no inertia left) jams. A body that stops stays until the next step.
    """
    way = 1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0
    if way == 0.0:
        way = 1.0 if shaft + load_shaft > 0.0 else -1.0
    after, passed, joint = 0.0, 0.0, -load_shaft
    hold_forward, hold_backward = np.inf, np.inf
    if speed == 0.0:
        hold_forward, hold_backward = friction[2], friction[3]
    for driven in (True, False):
        share = 1.0 + losses[0] if driven else 1.0 - losses[1]
        if front + near * share <= 0.0:
            return 0.0, 0.0, -load_shaft
        after, passed = dry_move(
            front + near * share, drag + load_drag * share, shaft + load_shaft * share,
            friction[0], friction[1], hold_forward, hold_backward, speed, h,
        )  # fmt: skip
        if speed == 0.0 and way * after < 0.0:
            after, passed = 0.0, 0.0
        joint = (near * (after - speed) + load_drag * passed) / h - load_shaft
        if driven and way * joint >= 0.0:
            break
    return after, passed, joint


@njit(error_model="numpy")
def both_levels(one, two):
    """The friction of two joints that turn as one, as `move` takes it."""
    return (
        one[0] + two[0], one[1] + two[1], one[2] + two[2], one[3] + two[3], one[4] + two[4],
        one[5] + two[5], one[6] if abs(one[6]) > abs(two[6]) else two[6],
    )  # fmt: skip


@njit(error_model="numpy")
def play_move(
    front, behind, drag, drag_behind, push, pull, friction, free, stretch, flanks, body, h
):
    """Two bodies with play between them after h: (speed, way, stretch, speed and way behind).

    `front` (inertia of the motor's side, with drag, push and friction) and `behind` (under the
    torque `pull` and `drag_behind`) part after their first meeting with the share `rebound` of the
    speed at which they met and stay together at the next one within h; `free` is the friction in
    between. `flanks` is (half_gap, rebound), `body` is (speed, speed behind, gap), the gap being
    front less behind angle within +-half_gap.
    """
    half_gap, rebound = flanks
    speed, speed_behind, gap = body
    way, way_behind, left = 0.0, 0.0, h
    both = front + behind
    for _ in range(MAX_PLAY_PIECES):
        side = 0.0
        if gap >= half_gap and speed >= speed_behind:
            side = 1.0
        elif gap <= -half_gap and speed <= speed_behind:
            side = -1.0
        if side != 0.0:
            if speed != speed_behind:
                speed = speed_behind = (front * speed + behind * speed_behind) / both
            after, moved, stretched = move(
                both, drag + drag_behind, push + pull, friction, stretch, speed, left
            )
            felt = pull - drag_behind * moved / left
            if side * (behind * (after - speed) / left - felt) >= 0.0:
                way, way_behind = way + moved, way_behind + moved
                return after, way, stretched, after, way_behind
        after, moved, stretched = move(front, drag, push, free, stretch, speed, left)
        after_behind = slid(behind, drag_behind, pull, speed_behind, left)
        moved_behind = 0.5 * left * (speed_behind + after_behind)
        gap_after = gap + moved - moved_behind
        if abs(gap_after) <= half_gap:
            way, way_behind = way + moved, way_behind + moved_behind
            return after, way, stretched, after_behind, way_behind
        # the flanks meet: when, taking the gap's acceleration as constant
        limit = half_gap if gap_after > 0.0 else -half_gap
        closing = speed - speed_behind
        bend = 0.5 * (after - after_behind - closing) / left
        length = min(_first_root(bend, closing, gap - limit, left), left)
        after, moved, stretch = move(front, drag, push, free, stretch, speed, length)
        after_behind = slid(behind, drag_behind, pull, speed_behind, length)
        way, way_behind = way + moved, way_behind + 0.5 * length * (speed_behind + after_behind)
        gap, left = limit, left - length
        apart = rebound * (after - after_behind) / both
        speed = speed_behind = (front * after + behind * after_behind) / both
        speed, speed_behind = speed - behind * apart, speed_behind + front * apart
        rebound = 0.0
        if left <= 1e-12 * h:
            break
    return speed, way, stretch, speed_behind, way_behind


@njit(error_model="numpy")
def _first_root(a, b, c, default):
    """Smallest root above zero of a t^2 + b t + c, with c the distance to go."""
    under = b * b - 4.0 * a * c
    if under < 0.0:
        return default
    q = -0.5 * (b + (np.sqrt(under) if b >= 0.0 else -np.sqrt(under)))
    first, second = default, default
    if a != 0.0 and q / a > 0.0:
        first = q / a
    if q != 0.0 and c / q > 0.0:
        second = c / q
    return min(first, second)


@njit(error_model="numpy")
def contact_share(depth, depth_after):
    """Share of a step in contact, and the largest depth in it, of a steady passage."""
    if depth > 0.0 and depth_after > 0.0:
        return 1.0, 0.0
    deepest = max(depth, depth_after)
    if deepest <= 0.0:
        return 0.0, 0.0
    return deepest / abs(depth_after - depth), deepest


@njit(error_model="numpy")
def _bouc_wen_slope(fx, stretch, way):
    share = abs(stretch) / fx[e.BOUC_WEN_YIELD]
    n = fx[e.BOUC_WEN_EXPONENT]
    if n == 1.0:
        power = share
    elif n == 2.0:
        power = share * share
    else:
        power = share**n
    sign = 1.0 if way * stretch > 0.0 else -1.0 if way * stretch < 0.0 else 0.0
    return 1.0 - power * (fx[e.BOUC_WEN_SHAPE] + (1.0 - fx[e.BOUC_WEN_SHAPE]) * sign)


@njit(error_model="numpy")
def _bouc_wen_after(fx, stretch, way):
    """The stretch after a way, by the midpoint rule over pieces that it is stable in."""
    longest = BOUC_WEN_PIECE * fx[e.BOUC_WEN_YIELD] / max(fx[e.BOUC_WEN_EXPONENT], 1.0)
    pieces = int(min(abs(way) / longest, MOST_PIECES)) + 1
    part = way / pieces
    for _ in range(pieces):
        middle = stretch + 0.5 * part * _bouc_wen_slope(fx, stretch, part)
        stretch += part * _bouc_wen_slope(fx, middle, part)
    return stretch


@njit(error_model="numpy")
def rounded(x):
    """A number to 33 bits: rows of a recording that differ by round-off are of one length."""
    c = x * 1048577.0  # 2^20 + 1 (Veltkamp)
    return c - (c - x)


@njit(error_model="numpy")
def branch_gains(fx, h, gains):
    """What Maxwell branches need of a length h, for `remember`: gains (N_GAINS or more,)."""
    for j in range(e.N_BRANCHES):
        if fx[e.BRANCH_STIFFNESS + j] != 0.0:
            x = h / fx[e.BRANCH_TIME + j]
            gains[j] = -np.expm1(-x)
            gains[e.N_BRANCHES + j] = 1.0 / x


@njit(error_model="numpy")
def remember(fx, y, way, gains):
    """Move the spring's memory by a piece of deflection `way` passed steadily.

    `gains` are those of `branch_gains` for the time that it takes.
    """
    for j in range(e.N_SLIPS):
        if fx[e.SLIP_STIFFNESS + j] != 0.0:
            y[SLIP + j] = clip(y[SLIP + j] + way, fx[e.SLIP_YIELD + j])
    if fx[e.BOUC_WEN] != 0.0:
        y[BOUC_WEN_STRETCH] = _bouc_wen_after(fx, y[BOUC_WEN_STRETCH], way)
    for j in range(e.N_BRANCHES):
        if fx[e.BRANCH_STIFFNESS + j] != 0.0:
            y[BRANCH + j] += gains[j] * (way * gains[e.N_BRANCHES + j] - y[BRANCH + j])


@njit(error_model="numpy")
def remembered_torque(fx, y):
    """Torque [Nm] of the spring's memory elements."""
    torque = 0.0
    for j in range(e.N_SLIPS):
        torque += fx[e.SLIP_STIFFNESS + j] * y[SLIP + j]
    for j in range(e.N_BRANCHES):
        torque += fx[e.BRANCH_STIFFNESS + j] * y[BRANCH + j]
    return torque + fx[e.BOUC_WEN] * y[BOUC_WEN_STRETCH]


@njit(error_model="numpy")
def warm_up(fx, y, heat, h):
    """Warm winding and case for h under a heat flow [W]; explicit midpoint."""
    winding, case = y[WINDING_RISE], y[CASE_RISE]
    middle_w, middle_c = winding, case
    for length in (0.5 * h, h):
        across = fx[e.WINDING_TO_CASE] * (middle_w - middle_c)
        out = fx[e.CASE_TO_AMBIENT] * middle_c
        middle_w = winding + length * (heat - across) / fx[e.WINDING_CAPACITY]
        middle_c = case + length * (across - out) / fx[e.CASE_CAPACITY]
    y[WINDING_RISE], y[CASE_RISE] = middle_w, middle_c
