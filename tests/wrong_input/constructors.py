"""Wrong input to what a scene is made of: bodies, walls, effects, accuracy, and the scene itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import physics as p
from tests.wrong_input.case import Case

TETRAHEDRON = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
NAN = float("nan")


def ball(**more) -> p.Sphere:
    """A ball that touches nothing."""
    return p.Sphere(1.0, 1.0, **{"pos": (0, 2, 0), **more})


def scene(*effects, walls=None) -> p.Scene:
    """A ball in the box, and these effects."""
    return p.Scene([ball()], p.three_walls() if walls is None else walls, effects)


def round_hull(corners: int) -> p.Hull:
    """The hull of points on a sphere, all of which are corners."""
    points = np.random.default_rng(0).normal(size=(corners, 3))
    return p.Hull(points / np.linalg.norm(points, axis=1)[:, None], 1)


def rows(*cases: tuple[str, Callable, tuple[str, ...]]) -> list[Case]:
    """Rows of the table."""
    return [Case(*case) for case in cases]


# fmt: off
BODIES = rows(
    ("mass-zero", lambda: p.Sphere(1, 0), ("mass is 0.0", "greater than 0")),
    ("mass-negative", lambda: p.Block((1, 1, 1), -2), ("mass is -2.0", "greater than 0")),
    ("mass-infinite", lambda: p.Sphere(1, np.inf), ("mass is inf", "finite")),
    ("mass-string", lambda: p.Sphere(1, "1"), ("mass is '1'", "allowed is one number")),
    ("mass-bool", lambda: p.Sphere(1, True), ("mass is True", "allowed is one number")),
    ("mass-numpy-bool", lambda: p.Sphere(1, np.True_), ("mass is ", "True", "allowed is one number")),
    ("mass-complex", lambda: p.Sphere(1, 1 + 2j), ("mass is (1+2j)", "allowed is one number")),
    ("mass-list", lambda: p.Sphere(1, [1.0]), ("mass has shape (1,)", "allowed is one number")),
    ("mass-huge-integer", lambda: p.Sphere(1, 10**400), ("mass is an integer of 1329 bits", "one number")),
    ("mass-subnormal", lambda: p.Sphere(1, 5e-324), ("mass is 5e-324 kg", "1e-150 and 1e+150", "other units")),
    ("mass-too-large", lambda: p.Block((1e3, 1, 1), 1e305), ("mass is 1e+305 kg", "1e-150 and 1e+150")),
    ("mass-missing", lambda: p.Sphere(1), ("mass is None and density is None", "exactly one of the two")),
    ("mass-and-density", lambda: p.Sphere(1, 2, density=3), ("mass is 2 and density is 3", "exactly one")),
    ("density-negative", lambda: p.Sphere(1, density=-1), ("density is -1.0", "greater than 0")),
    ("density-string", lambda: p.Block((1, 1, 1), density="iron"), ("density is 'iron'", "allowed is one number")),
    ("size-scalar", lambda: p.Block(2.0, 1), ("size is 2.0", "allowed is shape (3,)")),
    ("size-of-two", lambda: p.Block((1, 2), 1), ("size has shape (2,)", "allowed is shape (3,)")),
    ("size-empty", lambda: p.Block((), 1), ("size has shape (0,)", "allowed is shape (3,)")),
    ("size-missing", lambda: p.Block(mass=1), ("missing", "'size'")),
    ("size-ragged", lambda: p.Block((1, (2, 3), 1), 1), ("size is (1, (2, 3), 1)", "numbers in shape (3,)")),
    ("size-set", lambda: p.Block({1, 2, 3}, 1), ("size is {1, 2, 3}", "numbers in shape (3,)")),
    ("size-dict", lambda: p.Block({"x": 1}, 1), ("size is {'x': 1}", "numbers in shape (3,)")),
    ("size-strings", lambda: p.Block(np.array(["1", "2", "3"]), 1), ("size is ['1', '2', '3']", "numbers in shape")),
    ("size-complex", lambda: p.Block(np.ones(3) * 1j, 1), ("size is ", "1.j", "numbers in shape (3,)")),
    ("size-bools", lambda: p.Block(np.ones(3, bool), 1), ("size is ", "True", "numbers in shape (3,)")),
    ("size-with-a-bool", lambda: p.Block([1, True, 1], 1), ("size is [1, True, 1]", "numbers in shape (3,)")),
    ("size-times", lambda: p.Block(np.zeros(3, "m8[s]"), 1), ("size is ", "numbers in shape (3,)")),
    ("size-tiny", lambda: p.Block((1e-200,) * 3, 1), ("moments of inertia are [0., 0., 0.]", "1e-150", "units")),
    ("radius-none", lambda: p.Sphere(None, 1), ("radius is None", "allowed is one number")),
    ("semi-axes-zero", lambda: p.Ellipsoid((1, 0, 1), 1), ("semi_axes is [1., 0., 1.]", "greater than 0")),
    ("capsule-radius", lambda: p.Capsule(0, 1, 1), ("radius is 0", "greater than 0")),
    ("capsule-length", lambda: p.Capsule(1, -1, 1), ("length is -1", "greater than 0")),
    ("cylinder-radius", lambda: p.Cylinder(0, 1, 1), ("radius is 0", "greater than 0")),
    ("cylinder-height", lambda: p.Cylinder(1, -1, 1), ("height is -1", "greater than 0")),
    ("compound-empty", lambda: p.Compound([]), ("parts is empty", "at least one part")),
    ("compound-number", lambda: p.Compound(3), ("parts is 3", "allowed is a list of Block")),
    ("compound-of-numbers", lambda: p.Compound([3]), ("parts[0] is 3", "instances of Block")),
    ("compound-mass", lambda: p.Compound([ball()], -1), ("mass is -1.0", "greater than 0")),
    ("capsule-length-none", lambda: p.Capsule(1, None, 1), ("length is None", "allowed is one number")),
    ("points-too-few", lambda: p.Hull(TETRAHEDRON[:2], 1), ("points has 2", "at least 4")),
    ("points-flat", lambda: p.Hull([*TETRAHEDRON[:3], (1, 1, 0)], 1), ("points lie in one plane", "span a volume")),
    ("points-nan", lambda: p.Hull([*TETRAHEDRON, (0, 0, NAN)], 1), ("points[4, 2] is nan", "finite")),
    ("points-of-two", lambda: p.Hull([row[:2] for row in TETRAHEDRON], 1), ("points has shape (4, 2)", "rows of 3")),
    ("points-none", lambda: p.Hull(None, 1), ("points is None", "rows of 3 numbers")),
    ("points-far", lambda: p.Hull(np.array(TETRAHEDRON) * 1e308, 1), ("points is ", "1e+308", "below 1e+150")),
    ("points-too-many", lambda: round_hull(80), ("points has a hull of 80 corners", "at most 64")),
    ("pos-none", lambda: ball(pos=None), ("pos is None", "numbers in shape (3,)")),
    ("pos-nan", lambda: ball(pos=(0, NAN, 0)), ("pos is [ 0., nan, 0.]", "finite")),
    ("pos-generator", lambda: ball(pos=(x for x in (1, 2, 3))), ("pos is <generator", "numbers in shape (3,)")),
    ("pos-masked", lambda: ball(pos=np.ma.array([1, 2, 3], mask=[0, 1, 0])), ("pos is masked_array", "numbers")),
    ("linvel-string", lambda: ball(linvel="fast"), ("linvel is 'fast'", "numbers in shape (3,)")),
    ("angvel-with-none", lambda: ball(angvel=(0, None, 0)), ("angvel is (0, None, 0)", "numbers in shape (3,)")),
    ("quat-zero", lambda: ball(quat=(0, 0, 0, 0)), ("quat is [0., 0., 0., 0.] of norm 0", "norm 1 within 0.0001")),
    ("quat-of-three", lambda: ball(quat=(1, 0, 0)), ("quat has shape (3,)", "allowed is shape (4,)")),
    ("quat-not-unit", lambda: ball(quat=(1, 1, 0, 0)), ("quat is [1., 1., 0., 0.]", "norm 1.41421", "within 0.0001")),
    ("quat-too-rough", lambda: ball(quat=(1.0002, 0, 0, 0)), ("of norm 1.0002", "norm 1 within 0.0001")),
    ("inertia-negative", lambda: ball(inertia_body=(1, -1, 1)), ("inertia_body is (1, -1, 1)", "greater than 0")),
    ("inertia-triangle", lambda: ball(inertia_body=(1, 1, 3)), ("inertia_body is (1, 1, 3)", "triangle")),
    ("inertia-asymmetric", lambda: ball(inertia_body=[[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]),
     ("inertia_body is [[1, 0.5, 0]", "symmetric")),
    ("inertia-string", lambda: ball(inertia_body="solid"), ("inertia_body is 'solid'", "numbers in shape (3, 3)")),
    ("center-alone", lambda: p.Block((1, 1, 1), 1, center=(0.1, 0, 0)), ("center is (0.1, 0.0, 0.0)", "inertia_body")),
    ("center-of-a-sphere", lambda: ball(center=(0.1, 0, 0)), ("Sphere", "'center'", "(0.1, 0, 0)", "allowed are")),
    ("body-keyword", lambda: p.Block((1, 1, 1), 1, densty=1), ("Block", "'densty' (given: 1)", "allowed are density,")),
    ("body-without-shape", lambda: p.Body(), ("Body has no shape", "allowed are Block, Sphere")),
)

WALLS = rows(
    ("normal-zero", lambda: p.HalfSpace((0, 0, 0)), ("HalfSpace.normal is (0, 0, 0)", "any vector but zero")),
    ("normal-scalar", lambda: p.HalfSpace(1), ("HalfSpace.normal is 1.0", "allowed is shape (3,)")),
    ("offset-list", lambda: p.HalfSpace((0, 1, 0), [1.0]), ("HalfSpace.offset has shape (1,)", "one number")),
    ("offset-none", lambda: p.HalfSpace((0, 1, 0), None), ("HalfSpace.offset is None", "one number")),
    ("half-width-string", lambda: p.three_walls("wide"), ("half_width is 'wide'", "one number")),
    ("half-width-negative", lambda: p.three_walls(-1), ("half_width is -1.0", "greater than 0")),
    ("half-width-keyword", lambda: p.three_walls(width=1), ("three_walls", "'width' (given: 1)", "half_width")),
)

EFFECTS = rows(
    ("gravity-scalar", lambda: p.Gravity(-9.81), ("Gravity.acceleration is -9.81", "allowed is shape (3,)")),
    ("gravity-none", lambda: p.Gravity(None), ("Gravity.acceleration is None", "numbers in shape (3,)")),
    ("restitution-two", lambda: p.Contact(restitution=2), ("Contact.restitution is 2.0", "from 0 to 1")),
    ("restitution-bool", lambda: p.Contact(restitution=True), ("Contact.restitution is True", "one number")),
    ("between-bodies", lambda: p.Contact(between_bodies="no"), ("Contact.between_bodies is 'no'", "True and False")),
    ("tangential", lambda: p.Contact(tangential=1.5), ("Contact.tangential is 1.5", "from -1 to 1")),
    ("stiffness-zero", lambda: p.Contact(stiffness=0), ("Contact.stiffness is 0.0", "greater than 0")),
    ("damping-alone", lambda: p.Contact(damping=1), ("Contact.damping is 1.0", "without a stiffness is 0")),
    ("stiff-and-bouncy", lambda: p.Contact(0.5, stiffness=9), ("Contact.restitution is 0.5 with a stiff", "None")),
    ("friction-negative", lambda: p.Friction(-0.1), ("Friction.coefficient is -0.1", "at least 0")),
    ("friction-none", lambda: p.Friction(None), ("Friction.coefficient is None", "one number")),
    ("friction-of-three", lambda: p.Friction((1, 2, 3), (1, 0, 0)), ("Friction.coefficient has shape (3,)", "(2,)")),
    ("friction-needless-axis", lambda: p.Friction(0.5, (1, 0, 0)), ("Friction.axis is (1, 0, 0)", "None with one")),
    ("friction-without-axis", lambda: p.Friction((0.5, 0.1)), ("Friction.axis is None", "direction with two")),
    ("friction-axis-zero", lambda: p.Friction((0.5, 0.1), (0, 0, 0)), ("Friction.axis is (0, 0, 0)", "but zero")),
    ("friction-keyword", lambda: p.Friction(coeficient=1), ("'coeficient' (given: 1)", "allowed are coefficient,")),
    ("rolling-negative", lambda: p.RollingFriction(-1), ("RollingFriction.radius is -1.0", "at least 0")),
    ("spin-string", lambda: p.SpinFriction("x"), ("SpinFriction.radius is 'x'", "one number")),
    ("actuator-limit", lambda: p.Actuator(limit_force=0), ("Actuator.limit_force is 0.0", "greater than 0")),
    ("actuator-lag", lambda: p.Actuator(lag=-1), ("Actuator.lag is -1.0", "at least 0")),
    ("sleeping-slops", lambda: p.Sleeping(0), ("Sleeping.slops is 0.0", "greater than 0")),
    ("drag-negative", lambda: p.Drag(-1), ("Drag.coefficient is -1.0", "at least 0")),
    ("angular-drag-infinite", lambda: p.AngularDrag(quadratic=np.inf), ("AngularDrag.quadratic is inf", "finite")),
    ("magnus-string", lambda: p.Magnus("x"), ("Magnus.coefficient is 'x'", "one number")),
    ("wind-scalar", lambda: p.Wind(3.0), ("Wind.velocity is 3.0", "shape (3,)")),
    ("wind-seed", lambda: p.Wind(seed=1.5), ("Wind.seed is 1.5", "integers of at least 0")),
    ("buoyancy-normal", lambda: p.Buoyancy(normal=(0, 0, 0)), ("Buoyancy.normal is (0.0, 0.0, 0.0)", "but zero")),
    ("spring-stiffness", lambda: p.Spring(stiffness=-1), ("Spring.stiffness is -1.0", "at least 0")),
    ("spring-body-bool", lambda: p.Spring(body=True), ("Spring.body is True", "integers")),
    ("spring-to-itself", lambda: p.Spring(other=0), ("Spring.other is 0", "other bodies and None")),
    ("push-frame", lambda: p.Push(frame="local"), ("Push.frame is 'local'", "allowed are world, body")),
    ("push-frame-list", lambda: p.Push(frame=["world"]), ("Push.frame is ['world']", "allowed are world, body")),
)

SCENES = rows(
    ("bodies-none", lambda: p.Scene(None), ("Scene.bodies is None", "a list of Block")),
    ("bodies-string", lambda: p.Scene("ball.toml"), ("Scene.bodies is 'ball.toml'", "a list of Block")),
    ("bodies-dict", lambda: p.Scene({"a": ball()}), ("Scene.bodies is {'a': Sphere(", "a list of Block")),
    ("bodies-empty", lambda: p.Scene([]), ("Scene.bodies is empty", "at least one")),
    ("bodies-class", lambda: p.Scene([p.Block]), ("Scene.bodies[0] is <class", "write Block(...)")),
    ("bodies-walls", lambda: p.Scene(p.three_walls()), ("Scene.bodies[0] is HalfSpace(", "instances of Block")),
    ("walls-none", lambda: p.Scene([ball()], None), ("Scene.walls is None", "a list of HalfSpace")),
    ("walls-tuple", lambda: p.Scene([ball()], [(0, 1, 0)]), ("Scene.walls[0] is (0, 1, 0)", "HalfSpace")),
    ("effects-number", lambda: p.Scene([ball()], [], 5), ("Scene.effects is 5", "a list of Gravity")),
    ("effects-names", lambda: p.Scene([ball()], [], ["Gravity"]), ("Scene.effects[0] is 'Gravity'", "instances")),
    ("effects-class", lambda: p.Scene([ball()], [], [p.Gravity]), ("Scene.effects[0] is <class", "Gravity(...)")),
    ("two-gravities", lambda: scene(p.Gravity(), p.Gravity()), ("Scene.effects holds 2 Gravity", "allowed is one")),
    ("friction-alone", lambda: scene(p.Friction()), ("Friction without Contact", "add physics.Contact()")),
    ("tangential-alone", lambda: scene(p.Contact(tangential=0.5)), ("Contact.tangential is 0.5", "add physics.Fr")),
    ("wind-alone", lambda: scene(p.Wind()), ("Scene.effects holds Wind", "add physics.Drag()")),
    ("spring-to-nobody", lambda: scene(p.Spring(body=9)), ("Spring.body is 9", "indices below 1")),
    ("axis-is-normal", lambda: scene(p.Contact(), p.Friction((1, 2), (0, 1, 0))), ("axis is [0.0, 1.0", "along")),
    ("axes-too-few", lambda: scene(p.Contact(), p.Friction((1, 2), ((1, 0, 0),) * 2)), ("Friction.axis has 2", "or 3")),
    ("lift-of-a-cylinder", lambda: p.Scene(p.Cylinder(1, 1, 1), [], p.Magnus()), ("Magnus", "[0] is a cylinder")),
    ("lift-of-a-capsule", lambda: p.Scene(p.Capsule(1, 1, 1), [], p.Magnus()), ("Magnus", "[0] is a capsule")),
    ("lift-of-a-compound", lambda: p.Scene(p.Compound([ball()]), [], p.Magnus()), ("Magnus", "is a compound", "block")),
    ("lift-of-a-hull", lambda: p.Scene(p.Hull(TETRAHEDRON, 1), [], p.Magnus()), ("Magnus", "[0] is a hull", "block")),
    ("effect-by-name", lambda: scene().effect("Gravity"), ("kind is 'Gravity'", "the class of an effect")),
    ("scene-keyword", lambda: p.Scene([ball()], efects=[]), ("'efects' (given: [])", "allowed are effects,")),
)

ACCURACIES = rows(
    ("substeps-float", lambda: p.Accuracy(substeps=1.5), ("Accuracy.substeps is 1.5", "integers of at least 1")),
    ("iterations-huge", lambda: p.Accuracy(iterations=10**30), ("Accuracy.iterations is 1000", "to 2147483647")),
    ("tolerance-string", lambda: p.Accuracy(tolerance="small"), ("Accuracy.tolerance is 'small'", "one number")),
    ("rest-share", lambda: p.Accuracy(rest_share=2), ("Accuracy.rest_share is 2.0", "from 0 to 1")),
    ("scheme", lambda: p.Accuracy(scheme="rk5"), ("Accuracy.scheme is 'rk5'", "allowed are rk4,")),
    ("scheme-list", lambda: p.Accuracy(scheme=["exact"]), ("Accuracy.scheme is ['exact']", "allowed are events")),
    ("solver", lambda: p.Accuracy(solver="sweep"), ("Accuracy.solver is 'sweep'", "allowed are sweeps, ")),
    ("slip-none", lambda: p.Accuracy(slip=None), ("Accuracy.slip is None", "allowed are mean, end")),
    ("collisions", lambda: p.Accuracy(collisions="both"), ("Accuracy.collisions is 'both'", "simultaneous")),
    ("accuracy-keyword", lambda: p.Accuracy(tolerence=1), ("'tolerence' (given: 1)", "allowed are tolerance,")),
)
# fmt: on

CASES = BODIES + WALLS + EFFECTS + SCENES + ACCURACIES
