#version 450
// A part of a tint in each of the first SETS descriptor sets.
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

#define SET(n) layout(set = n, binding = 0) uniform Tint##n { vec4 value; } tint##n;
SET(0)
#if SETS > 1
SET(1)
#endif
#if SETS > 2
SET(2)
SET(3)
#endif
#if SETS > 4
SET(4)
SET(5)
SET(6)
#endif
#if SETS > 7
SET(7)
#endif

void main() {
    vec4 tint = tint0.value;
#if SETS > 1
    tint += tint1.value;
#endif
#if SETS > 2
    tint += tint2.value + tint3.value;
#endif
#if SETS > 4
    tint += tint4.value + tint5.value + tint6.value;
#endif
#if SETS > 7
    tint += tint7.value;
#endif
    target = colour * tint;
}
