/* Writes a trace of three translucent discs that cut through each other. */
#define SCREENDOOR_TRACE_IMPLEMENTATION
#include "screendoor_trace.h"

#include <stdio.h>

int main(void) {
    /* Centre and radius in pixels, depth there and its slopes, colour, alpha. */
    static const float discs[3][10] = {{135, 95, 80, 0.55f, 0.0008f, 0, 0.9f, 0.1f, 0.05f, 0.6f},
        {185, 95, 80, 0.50f, -0.0008f, 0, 0.05f, 0.3f, 0.9f, 0.5f},
        {160, 145, 80, 0.50f, 0, 0.0008f, 0.1f, 0.8f, 0.1f, 0.4f}};
    /* Along parallel lines, 1 to 11 before the camera; what is 8 wide fills the frame. */
    static const screendoor_view view = {true, 1, 11,
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
        {0.25, 0, 0, 0, 0, 1 / 3.0, 0, 0, 0, 0, -0.1, 0, 0, 0, -0.1, 1}};
    static screendoor_header header; /* all zero: the defaults */
    header.width = 320, header.height = 240, header.samples = 8;
    header.background[0] = header.background[1] = header.background[2] = 0.8f;
    header.source = "three discs from C", header.view = &view;
    const int8_t *positions = screendoor_standard_positions(header.samples);

    screendoor_trace *trace = screendoor_trace_open("discs.arrow", &header);
    for (uint32_t i = 0; i < 3; i++) {
        const float *d = discs[i];
        for (uint32_t pixel = 0; pixel < header.width * header.height; pixel++) {
            screendoor_fragment f;
            f.x = pixel % header.width, f.y = pixel / header.width, f.coverage = 0;
            float right = (float)f.x + 0.5f - d[0], down = (float)f.y + 0.5f - d[1];
            for (uint32_t s = 0; s < header.samples; s++) {
                float a = right + positions[2 * s] / 16.0f, b = down + positions[2 * s + 1] / 16.0f;
                f.coverage |= (uint64_t)(a * a + b * b < d[2] * d[2]) << s;
            }
            if (f.coverage == 0) continue;
            screendoor_depth(&f, d[3] + right * d[4] + down * d[5], d[4], d[5]);
            f.r = d[6], f.g = d[7], f.b = d[8], f.alpha = d[9];
            f.primitive = f.object = i;
            screendoor_trace_push(trace, &f);
        }
    }
    bool good = screendoor_trace_close(trace);
    if (!good) fprintf(stderr, "%s\n", screendoor_trace_error(trace));
    screendoor_trace_free(trace);
    return good ? 0 : 1;
}
