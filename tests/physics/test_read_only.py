"""Read-only views of a world: NumPy refuses to write into them, PyTorch does not (docs/conventions.md)."""

from __future__ import annotations

import copy
import warnings

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

VIEWS = ("pos", "quat", "linvel", "angvel")


@pytest.fixture
def world() -> physics.World:
    """A body at rest in the air."""
    return physics.World(physics.Scene([physics.Sphere(0.5, 1.0, pos=(1, 2, 3))]))


@pytest.fixture
def torch():
    """PyTorch, whose warning about read-only memory comes once in a process."""
    found = pytest.importorskip("torch")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The given NumPy array is not writable")
        yield found


@pytest.mark.parametrize("name", VIEWS)
def test_numpy_does_not_write_into_a_view(world, name):
    view = getattr(world, name)
    with pytest.raises(ValueError, match="read-only"):
        view += 1.0
    assert memoryview(view).readonly


@pytest.mark.parametrize("name", VIEWS)
def test_dlpack_hands_a_view_on_as_read_only_or_not_at_all(world, name):
    view = getattr(world, name)
    with pytest.raises(BufferError, match="read"):
        view.__dlpack__()  # the old form, which cannot tell that memory is read-only
    if np.lib.NumpyVersion(np.__version__) >= "2.1.0":
        with pytest.raises(ValueError, match="read-only"):
            np.from_dlpack(view)[...] = 1.0


@pytest.mark.parametrize("share", ["from_numpy", "as_tensor", "from_dlpack"])
def test_torch_writes_through_what_it_shares(world, torch, share):
    """The trap of the page: once PyTorch refuses, its paragraph can go."""
    getattr(torch, share)(world.pos).add_(1.0)
    assert world.pos.tolist() == [[[2.0, 3.0, 4.0]]]


@pytest.mark.parametrize("name", VIEWS)
def test_a_tensor_of_a_copy_leaves_the_world_alone(world, torch, name):
    view = getattr(world, name)
    before = view.copy()
    for tensor in (torch.tensor(view), torch.from_numpy(view.copy())):
        np.testing.assert_array_equal(tensor.numpy(), before)
        tensor.add_(1.0)
        np.testing.assert_array_equal(view, before)


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("pos", "set_state(pos="),
        ("quat", "set_state(quat="),
        ("linvel", "set_state(linvel="),
        ("angvel", "set_state(angvel="),
        ("state", "set_state(pos="),
        ("gravity", "set_parameters(gravity="),
        ("params", "set_parameters(mass="),
        ("walls", "set_parameters(wall_friction="),
        ("mass", "set_parameters(mass="),
        ("friction", "set_parameters(friction="),
        ("dt", "step(dt="),
        ("worlds", "World(worlds="),
        ("scene", "World(scene="),
        ("memory", "restore"),
        ("names", "World(scene)"),
    ],
)
def test_an_attribute_is_not_set_and_the_error_names_the_method(world, name, advice):
    before = vars(world).get(name)
    with pytest.raises(AttributeError) as error:
        setattr(world, name, 5.0)
    assert str(error.value).startswith(f"World.{name} is ")
    assert advice in str(error.value)
    assert vars(world).get(name) is before


def test_a_copy_of_a_world_refuses_assignments_too(world):
    twin = copy.deepcopy(world)
    with pytest.raises(AttributeError, match="set_state"):
        twin.linvel = 5.0
    twin.set_state(linvel=(5.0, 0.0, 0.0))
    assert twin.linvel.tolist() == [[[5.0, 0.0, 0.0]]]
    assert not hasattr(twin, "mass")
