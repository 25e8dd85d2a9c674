"""Whether OpenGL computes in double precision as the processor does, to the last bit.

The language leaves quotients a little room, and not every driver keeps to ``precise``.  A device
that rounds otherwise could put a pixel on the other side of an edge, so it is not used.
"""

from __future__ import annotations

import numpy as np

from simplifier.device.card import GROUP, Card, Filled

_COUNT = 16 * GROUP

_SOURCE = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Numbers { double numbers[]; };
layout(std430, binding = 1) buffer Found { double found[]; };
void main() {
    int at = int(gl_GlobalInvocationID.x);
    double a = numbers[3 * at], b = numbers[3 * at + 1], c = numbers[3 * at + 2];
    precise double quotient = a / b;
    precise double sum = a * b + c * quotient;
    found[2 * at] = quotient;
    found[2 * at + 1] = sum;
}
"""


def computes_exactly(card: Card) -> bool:
    """Of the context that is current: quotients, and products that are added up."""
    numbers = np.random.default_rng(1).uniform(-256.0, 256.0, (_COUNT, 3))
    program = card.program(_SOURCE)
    with card.buffers(numbers, Filled(16 * _COUNT)) as (_, results):
        card.run(program, (_COUNT // GROUP,))
        found = card.read(results, np.float64, (_COUNT, 2))
    program.release()
    a, b, c = numbers.T
    quotient = a / b
    return bool((found[:, 0] == quotient).all() and (found[:, 1] == a * b + c * quotient).all())
