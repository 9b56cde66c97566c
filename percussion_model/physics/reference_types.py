"""What numba has to know of `reference`: a type for addresses of named tuples, and its fields."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.core.datamodel import PrimitiveModel, register_default
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr


class Reference(types.Type):  # type: ignore[misc]
    """Type of the address of a named tuple."""

    def __init__(self, target: Any) -> None:
        self.target = target
        super().__init__(name=f"Reference({target})")

    @property
    def key(self) -> Any:
        """What tells types apart."""
        return self.target


@register_default(Reference)
class _ReferenceModel(PrimitiveModel):  # type: ignore[misc]
    """Kept as a pointer."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, dmm.lookup(fe_type.target).get_value_type().as_pointer())


def _field(reference, name):
    """Place and type of a field; a tuple within is referred to as well."""
    if name not in reference.target.fields:
        return None
    place = reference.target.fields.index(name)
    kind = tuple(reference.target)[place]
    return place, Reference(kind) if isinstance(kind, types.BaseNamedTuple) else kind


@infer_getattr
class _Fields(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, reference, name):
        found = _field(reference, name)
        return None if found is None else found[1]


@lower_getattr_generic(Reference)
def _get(context, builder, reference, address, name):
    place, kind = _field(reference, name)
    inner = cgutils.gep_inbounds(builder, address, 0, place)
    return inner if isinstance(kind, Reference) else builder.load(inner)


def refer(typing, value):
    """Instructions for `reference.refer`."""

    def generate(context, builder, signature, args):
        return cgutils.alloca_once_value(builder, args[0])

    return Reference(value)(value), generate
