"""Texts of kernels: includes, and what arguments and structs they declare."""

import numpy as np
import pytest

from simulator.device.kernel_source import KERNELS, declared_arguments, declared_struct, expanded, kernel_source, read_macros


def test_headers_are_put_in_once():
    text = kernel_source("sensor.cl")
    assert "#include" not in text
    assert text.count("#define PHILOX_H") == 1
    assert expanded('#include "cfa.h"\n#include "cfa.h"\n').count("#define CFA_H") == 1


def test_arguments_are_read_from_the_text_of_the_kernel():
    source = """// kernel void other(float a)
    kernel void probe(global const float *restrict image, constant float *numbers, // [e-]
                      const uint width, const float side) { }"""
    assert declared_arguments(source, "probe") == {"image": "*", "numbers": "*", "width": "uint", "side": "float"}


STRUCT = """
struct place { uint rows, columns; // of "samples"; not of photosites
               int first; float scale, offset[2]; };
kernel void probe(global float *result, const struct place place) {
    result[0] = (float)place.rows; result[1] = (float)place.columns; result[2] = (float)place.first;
    result[3] = place.scale; result[4] = place.offset[0]; result[5] = place.offset[1];
}"""
PLACE = {"offset": (0.25, -8.0), "first": -3, "scale": 1.5, "columns": 2**32 - 1024, "rows": 7}


def test_a_struct_has_the_fields_of_its_declaration():
    one, two = ("first", np.int32), ("offset", np.float32, (2,))
    expected = np.dtype([("rows", np.uint32), ("columns", np.uint32), one, ("scale", np.float32), two])
    assert declared_struct(STRUCT, "place") == expected and expected.itemsize == 24
    assert declared_arguments(STRUCT, "probe") == {"result": "*", "place": expected}


def test_fields_of_a_struct_are_bound_by_name(device):
    kernel, values = device.build(STRUCT, "probe", {}), [7, 2**32 - 1024, -3, 1.5, 0.25, -8.0]
    scalar = np.zeros((), declared_struct(STRUCT, "place"))
    for name, value in PLACE.items():
        scalar[name] = value
    for given in (PLACE, scalar[()]):
        result = device.zeros((6,), np.float32)
        device.run(kernel, (1,), None, result=result, place=given)
        assert device.download(result, (6,), np.float32).tolist() == values


@pytest.mark.parametrize(
    "given", [{k: v for k, v in PLACE.items() if k != "first"}, PLACE | {"middle": 1}, 3, np.float32(2.0)], ids=str
)
def test_a_missing_or_superfluous_field_is_an_error(device, given):
    kernel, result = device.build(STRUCT, "probe", {}), device.zeros((6,), np.float32)
    with pytest.raises(
        TypeError, match=r"place of probe has the fields \['columns', 'first', 'offset', 'rows', 'scale'\], not"
    ):
        device.run(kernel, (1,), None, result=result, place=given)


@pytest.mark.parametrize("field", ["ulong size;", "uchar kind;", "float *place;", "uint4 four;", "struct other inner;"])
def test_fields_that_may_be_padded_are_refused(field):
    with pytest.raises(ValueError, match="struct place"):
        declared_struct(f"struct place {{ float scale; {field} }};", "place")


def test_a_struct_that_is_not_declared_is_an_error():
    with pytest.raises(ValueError, match="struct other is not declared"):
        declared_struct(STRUCT, "other")


def test_a_file_is_given_the_macros_that_it_or_a_header_of_it_reads():
    given = {"CFA_00": 0, "LAYERS": 2, "NODES_PER_PX": "2.0f", "ZONE": 0}
    assert read_macros("occlusion.cl", given) == {"LAYERS": 2}
    assert read_macros("defocus.cl", given) == {"NODES_PER_PX": "2.0f", "ZONE": 0}
    assert read_macros("own_color.cl", given) == {"CFA_00": 0}


def test_no_name_of_a_macro_is_put_together():
    """`read_macros` finds them as words."""
    assert not [path.name for path in sorted(KERNELS.glob("*.[ch]*")) if "##" in path.read_text(encoding="utf-8")]
