"""BallKick: kick a ball once, with spin, so that it flies around a post and through a ring."""

from __future__ import annotations

import numpy as np

import physics
from physics.world.gusts import set_winds
from rigid_env.tasks import Entry, Impulse, Task, Uniform, observe
from rigid_env.tasks.replacing import replaced

G = 9.81  # [m/s²]
RADIUS, MASS = 0.11, 0.43  # of a football: [m], [kg]
DRAG, LIFT = 0.25, 1.0  # coefficients of `physics.Drag` and `physics.Magnus`
DENSITY = 1.225  # of the air [kg/m³]
POST = (0.3, 3.5, 0.8)  # edges [m]
POST_SHARE = 0.45  # share of the distance to the ring at which the post stands
RING = 0.5  # radius of the ring [m]
FLIGHT = 6  # control steps of the longest flight
# changes of speed by the largest impulses: forward, sideways, and along the back of the ball [m/s]
SPEED, TURN, BRUSH = 30.0, 14.0, 3.5
SPIN_PER_BRUSH = 1.0 / (0.4 * RADIUS)  # spin by the impulse along the ball's back, over its change of speed [1/m]
LENGTHS, SIDE = (20.0, 2.0, 3.0), 0.2  # units of the observation [m]
VELOCITY, SPIN, WIND = 20.0, 50.0, 5.0  # further units of the observation [m/s], [rad/s], [m/s]
HALF_MISS = 2.0  # miss at which half of the largest penalty is lost [m]
AIMING_SPEED, AIMING_SPIN = 25.0, 75.0  # speed and spin of the controller's kicks [m/s], [rad/s]
SHOTS, PARTS = 8, 48  # trial shots of the controller's aim, and integration steps of a flight
CUTS = 20  # straight parts into which the path of a control step is cut


def ring_offset(worlds):
    """Vector (n, 3) from the centre of the ball to the centre of the ring [m]."""
    return worlds.drawn["ring"] - worlds.pos[:, 0]


def ring_entry(k):
    """Observation entry of axis `k` of `ring_offset`, in the unit of that axis."""
    return Entry(f"ring minus centre {'xyz'[k]}", "m", -5, 5, lambda w: ring_offset(w)[:, k], LENGTHS[k])


def least_distance(places, velocities, time, point):
    """Least distances of points from the paths of a ball, each a cubic given by two positions and velocities.

    The path is cut into `CUTS` straight parts. In free flight a part of 10 ms deviates by a t²/8, less than 1 mm.

    Parameters
    ----------
    places, velocities : pair of (n, 3) float
        Positions [m] and velocities [m/s] at the start and at the end.
    time : float
        Time between start and end [s].
    point : (n, 3) float
        Points [m].

    Returns
    -------
    (n,) float
        Distances [m].
    """
    s = np.linspace(0.0, 1.0, CUTS + 1)[:, None, None]
    (start, end), (first, last) = places, velocities
    way = (1 + 2 * s) * (1 - s) ** 2 * start + s**2 * (3 - 2 * s) * end
    way = way + time * (s * (1 - s) ** 2 * first + s**2 * (s - 1) * last)
    parts, offsets = np.diff(way, axis=0), point - way[:-1]
    shares = (offsets * parts).sum(axis=2) / np.maximum((parts**2).sum(axis=2), 1e-12)
    return np.linalg.norm(offsets - shares.clip(0.0, 1.0)[:, :, None] * parts, axis=2).min(axis=0)


class BallKick(Task):
    """Kick a ball once, with spin, so that it flies around a post and through a ring.

    ## Description

    A football lies on the ground. In the first control step of 0.2 s the agent kicks it with three impulses. Over the
    mass they are up to 30 m/s ahead, up to 14 m/s across, and up to 3.5 m/s along the back of the ball. This last one
    leaves a spin of up to 80 rad/s. Then the ball flies alone, with drag, with lift across its spin, and with wind. A
    post of 3.5 m hides the ring. Within 1.2 s the ball gets there only around the post, on a way that spin bends, or
    over it with topspin, where ring and wind allow it. Later actions have no effect.

    The argument `effects` changes the strength of effects: `effects=[physics.Drag(0.0), physics.Magnus(0.0)]` gives a
    flight without air. `draws={"wind": (0.0, 0.0)}` is a calm. A `physics.Wind` in `effects` needs such a fixed draw,
    and replaces it.

    ## Rewards

    `miss`: once the flight is over, -d / (d + 2 m), d the least distance between ball and centre of the ring.
    `success`: 1.

    ## Starting State

    The ball lies at the origin, at rest. The centre of the ring is 16 to 22 m ahead (x), 0.6 to 2.2 m high, and up to
    3 m to the side (z). The post stands at 0.45 of the way to it, up to 0.2 m to the side. The wind is horizontal, each
    component up to 5 m/s.

    ## Episode End

    Success: the centre of the ball has come within 0.5 m of the centre of the ring. The path between two control steps
    is the cubic given by the positions and velocities at both. Failure: the ball is past the ring, or 6 control steps
    (1.2 s) are over. `info` holds `miss`, the least distance so far [m].

    ## Version History

    - v0: first version.
    """

    scene = physics.Scene(
        bodies=[
            physics.Sphere(radius=RADIUS, mass=MASS, pos=(0.0, RADIUS, 0.0)),
            physics.Block(size=POST, mass=400.0, pos=(8.5, POST[1] / 2, 0.0)),
        ],
        walls=[physics.HalfSpace((0.0, 1.0, 0.0), 0.0)],
        effects=[
            physics.Gravity((0.0, -G, 0.0)),
            physics.Contact(restitution=0.5),
            physics.Friction(0.5),
            physics.Drag(DRAG, DENSITY),
            physics.Magnus(LIFT, DENSITY),
            physics.Wind((0.0, 0.0, 0.0)),
        ],
    )
    actions = (
        Impulse(0, SPEED / G, axes="x"),
        Impulse(0, TURN / G, axes="yz"),
        Impulse(0, BRUSH / G, point=(-RADIUS, 0.0, 0.0), axes="yz"),
    )
    observation = [
        *map(ring_entry, range(3)),
        observe.height(0, LENGTHS[1], 5),
        observe.linvel(0, VELOCITY, 5),
        observe.angvel(0, SPIN, 5),
        Entry("side of the post", "m", -1, 1, lambda w: w.drawn["side"], SIDE),
        Entry(("wind x", "wind z"), "m/s", -5, 5, lambda w: w.memory["wind"], WIND),
        Entry("least distance so far", "m", 0, 5, lambda w: w.measured["miss"], LENGTHS[0]),
        Entry("kick left", "1", 0, 1, lambda w: 1.0 * (w.steps == 0)),
    ]
    draws = {
        "ring": Uniform((16.0, 0.6, -3.0), (22.0, 2.2, 3.0)),
        "side": Uniform(-SIDE, SIDE),
        "wind": Uniform((-5.0, -5.0), (5.0, 5.0)),
    }
    explanations = {
        "ring": "centre of the ring [m]",
        "side": "place of the post along z, beside the line from ball to ring [m]",
        "wind": "velocity of the air along x and z [m/s]",
        "miss": "least distance between ball and centre of the ring so far [m]",
        "reward_miss": "minus a function of the miss, once the flight is over",
        "reward_success": "bonus for success",
    }
    camera = {"eye": (-7.0, 6.9, 5.0), "target": (8.3, -0.3, -1.1), "fov_y": 35.0}  # a free kick, from behind
    shown_box = ((-2.0, 0.0, -5.0), (24.0, 4.0, 5.0))
    memory = {"place": 3, "velocity": 3, "miss": 1, "wind": 2}
    max_episode_steps = FLIGHT

    def __init__(self, worlds: int = 1, *, frame_skip: int = 10, dt: float = 0.02, **settings):
        super().__init__(worlds, frame_skip=frame_skip, dt=dt, **settings)

    def place(self, drawn):
        """Place the post near the line between ball and ring."""
        ring = drawn["ring"]
        pos = np.zeros((len(ring), 2, 3))
        pos[:, 0, 1], pos[:, 1, 1] = RADIUS, POST[1] / 2
        pos[:, 1, 0] = POST_SHARE * ring[:, 0]
        pos[:, 1, 2] = POST_SHARE * ring[:, 2] + drawn["side"]
        return {"pos": pos}

    def begin(self, worlds):
        """Set the wind that the new episodes have drawn, unless `effects` fix the wind."""
        given = replaced(self.effects).get("wind")
        if given is None:
            worlds.memory["wind"][:] = worlds.drawn["wind"]
            set_winds(self.world, worlds.indices, np.insert(worlds.drawn["wind"], 1, 0.0, axis=1))
        else:
            worlds.memory["wind"][:] = np.asarray(given.velocity)[::2]
        worlds.memory["place"][:] = worlds.pos[:, 0]
        worlds.memory["miss"][:] = worlds.measured["miss"]

    def measure(self, worlds):
        """Least distance between the centres of ball and ring so far."""
        ball, memory = worlds.pos[:, 0], worlds.memory
        if not worlds.steps.any():  # episodes begin
            return {"miss": np.linalg.norm(ring_offset(worlds), axis=1)}
        places, velocities = (memory["place"], ball), (memory["velocity"], worlds.linvel[:, 0])
        way = least_distance(places, velocities, self.control_dt, worlds.drawn["ring"])
        return {"miss": np.minimum(memory["miss"], way)}

    def update(self, worlds):
        """Store position, velocity and miss, and set the limits of the actions to 0 after the kick."""
        worlds.memory["place"][:], worlds.memory["velocity"][:] = worlds.pos[:, 0], worlds.linvel[:, 0]
        worlds.memory["miss"][:] = worlds.measured["miss"]
        self.limits[worlds.indices[worlds.steps >= 1]] = 0.0

    def success(self, worlds):
        """Success: the ball has passed through the ring."""
        return worlds.measured["miss"] < RING

    def failure(self, worlds):
        """Failure: the ball is past the ring, or the longest flight is over."""
        is_past = worlds.pos[:, 0, 0] > worlds.drawn["ring"][:, 0]
        return ~worlds.success & (is_past | (worlds.steps >= FLIGHT))

    def rewards(self, worlds):
        """Reward at the end of the flight: 1 for a hit, minus a function of the miss, else 0."""
        miss = worlds.measured["miss"] / (worlds.measured["miss"] + HALF_MISS)
        return {
            "miss": np.where(worlds.success | worlds.failure, -miss, 0.0),
            "success": 1.0 * worlds.success,
        }

    def goal_mark(self, world):
        """Ring around its centre, across the x axis."""
        is_reached = bool(self.memory_arrays["miss"][world] < RING)
        return {"pos": self.drawn["ring"][world], "axis": (1.0, 0.0, 0.0), "radius": RING, "reached": is_reached}


def fly(velocity, spin, wind, distance):
    """Flight of a ball to a plane at some distance ahead, by the midpoint rule in equal parts of that distance.

    Parameters
    ----------
    velocity, spin, wind : (n, 3) float
        Velocity [m/s] and spin [rad/s] of the ball at the kick, and velocity of the air [m/s].
    distance : (n,) float
        Distance of the plane along x [m].

    Returns
    -------
    places : (PARTS + 1, n, 3) float
        Positions at the kick and after equal parts of the distance along x [m].
    duration : (n,) float
        Duration of the flight [s].
    """
    part = distance / PARTS
    place, duration = np.zeros_like(velocity), np.zeros_like(distance)
    places = [place]
    for _ in range(PARTS):
        half = 0.5 * part / velocity[:, 0]
        middle = velocity + half[:, None] * acceleration(velocity, spin, wind)
        time = part / np.maximum(middle[:, 0], 1.0)
        place = place + time[:, None] * middle
        velocity = velocity + time[:, None] * acceleration(middle, spin, wind)
        velocity[:, 0] = np.maximum(velocity[:, 0], 1.0)
        duration = duration + time
        places.append(place)
    return np.array(places), duration


def acceleration(velocity, spin, wind):
    """Acceleration (n, 3) of the ball by gravity, drag and lift [m/s²]."""
    air = velocity - wind
    area = np.pi * RADIUS**2
    drag = 0.5 * DENSITY * DRAG * area * np.linalg.norm(air, axis=1, keepdims=True) * air
    lift = 0.5 * DENSITY * LIFT * area * RADIUS * np.cross(spin, air)
    return (lift - drag) / MASS - np.array((0.0, G, 0.0))


def aim(ring, spin, wind):
    """Compute the velocity of a kick with a given spin that meets the ring, and the ball's path.

    Each shot moves the aiming point by the miss of the shot before. Drag and lift change little with the direction, so
    that a miss shrinks several times with each shot.

    Parameters
    ----------
    ring, spin, wind : (n, 3) float
        Centre of the ring relative to the ball [m], spin [rad/s], and velocity of the air [m/s].

    Returns
    -------
    velocity : (n, 3) float
        Velocity of the kick [m/s].
    places : (PARTS + 1, n, 3) float
        See `fly`.
    """
    velocity = np.zeros_like(ring)
    goal = ring.copy()
    for _ in range(SHOTS):
        velocity = AIMING_SPEED * goal / np.linalg.norm(goal, axis=1, keepdims=True)
        places, _ = fly(velocity, spin, wind, ring[:, 0])
        goal[:, 1:] += (ring - places[-1])[:, 1:]
    return velocity, places


def controller(observations: np.ndarray) -> np.ndarray:
    """Aim around both sides of the post through a model of the flight, and kick on the side with more room.

    Parameters
    ----------
    observations : (n, 15) float32

    Returns
    -------
    (n, 5) float32
    """
    count = len(observations)
    ring, wind = LENGTHS * observations[:, 0:3].astype(np.float64), np.zeros((count, 3))
    wind[:, ::2] = WIND * observations[:, 11:13]
    side = POST_SHARE * ring[:, 2] + SIDE * observations[:, 10]
    ring[:, 0] = np.maximum(ring[:, 0], 1.0)  # past the kick the actions have no effect
    kicks, rooms = [], []
    for turn in (-AIMING_SPIN, AIMING_SPIN):
        spin = np.tile((0.0, turn, 0.0), (count, 1))
        velocity, places = aim(ring, spin, wind)
        rooms.append(np.abs(places[round(POST_SHARE * PARTS), :, 2] - side))
        stroke = turn / SPIN_PER_BRUSH
        velocity[:, 2] -= stroke
        kicks.append(np.column_stack([velocity / (SPEED, TURN, TURN), np.zeros(count), np.full(count, stroke / BRUSH)]))
    best = np.where((rooms[0] > rooms[1])[:, None], *kicks)
    return best.clip(-1.0, 1.0).astype(np.float32)
