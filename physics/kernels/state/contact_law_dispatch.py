"""Contact laws beyond Coulomb's, which only some scenes declare: choose kernels by the type of a body's record.

If a scene declares rolling friction, the record of a body has a member `law_rolling`; the other laws have members of
the same kind. The value of the member is not used; its name tells the compiler that the law is declared. The laws'
coefficients of the body are in `body.laws`. A kernel that depends on a law is compiled for each type of the record.
Where a law is not declared, nothing of it is compiled, stored or passed on. Force fields use the same method
(`force_field_dispatch`).
"""

from __future__ import annotations

from physics.compiler.decorators import backend, by_type, members, when

# Names of the laws. Coefficients of declared laws are in this order in `body.laws` and in `params`.
LAW_TANGENTIAL, LAW_ROLLING, LAW_SPIN, LAW_ANISOTROPY = "tangential", "rolling", "spin", "anisotropy"
LAW_STIFFNESS, LAW_DAMPING = "stiffness", "damping"
LAWS = (LAW_TANGENTIAL, LAW_ROLLING, LAW_SPIN, LAW_ANISOTROPY, LAW_STIFFNESS, LAW_DAMPING)
_PREFIX = "law_"


def law_members(laws: tuple[str, ...]) -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, that a body's record has for these laws; none without laws."""
    if not laws:
        return []
    numbers = [("laws", float, (len(laws),)), *((_PREFIX + name, float) for name in laws)]
    return numbers + [("give", float)] * (LAW_STIFFNESS in laws)  # γ of a stage [1/kg], see `compliance`


def _declared(record) -> list[str]:
    """Names of the laws that a body's record declares; `record` may also be a workspace, or the type of either."""
    body = backend.member(record, "body") if "body" in members(record) else record
    return [name[len(_PREFIX) :] for name in members(body) if name.startswith(_PREFIX)]


def if_law(laws: tuple[str, ...], instead):
    """Decorate a kernel that is called only in scenes that declare at least one of `laws`.

    In other scenes the function `instead`, which takes the same arguments, is called in its place and inlined. The last
    argument of both is a body's record or the workspace; its type decides.
    """
    return when(lambda *types: bool(set(laws) & set(_declared(types[-1]))), instead)


def law_parameter(law: str, otherwise: float = 0.0):
    """Make a kernel of the argument `body` that returns a law's coefficient, or `otherwise` if it is not declared."""

    def chosen(body):
        declared = _declared(body)
        if law not in declared:
            return lambda body: otherwise
        place = declared.index(law)
        return lambda body: body.laws[place]

    return by_type(chosen)


def _nothing(params, i, end, body):
    return None


@if_law(LAWS, _nothing)
def bind_laws(params, i, end, body):
    """Copy the laws' coefficients of row i of `params`, its columns up to `end`, into the record `body`."""
    count = body.laws.shape[0]
    for k in range(count):
        body.laws[k] = params[i, end - count + k]
