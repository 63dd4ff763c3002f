/* Drives screendoor_trace.h for tests/it/c_header.rs.
 *
 *   check write OUT FRAGMENTS WIDTH HEIGHT SAMPLES [WORD...]   a file of fragments to a trace
 *   check raw OUT FRAGMENTS WIDTH HEIGHT SAMPLES               the same of raw fragments
 *   check refuse FOLDER                                        prints what is refused and why
 */
#include "screendoor_trace.h" /* the declarations alone, as most files of a project have them */

#define SCREENDOOR_TRACE_IMPLEMENTATION
#include "screendoor_trace.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int8_t positions[128];
static screendoor_view view;

/* Those of `header` in tests/it/util.rs, with a background that is harder to spell. */
static screendoor_header header_of(uint32_t width, uint32_t height, uint32_t samples) {
    screendoor_header header;
    int s;
    for (s = 0; s < 64; s++) {
        positions[2 * s] = (int8_t)(s % 8 * 2 - 8);
        positions[2 * s + 1] = (int8_t)(s / 8 * 2 - 8);
    }
    memset(&view, 0, sizeof view);
    view.near_plane = 0.5, view.far_plane = 200.0;
    for (s = 0; s < 16; s += 5) view.world_to_view[s] = 1.0;
    view.view_to_clip[0] = view.view_to_clip[5] = 1.0;
    view.view_to_clip[10] = -200.0 / (200.0 - 0.5);
    view.view_to_clip[11] = -1.0;
    view.view_to_clip[14] = -200.0 * 0.5 / (200.0 - 0.5);
    memset(&header, 0, sizeof header);
    header.width = width, header.height = height, header.samples = samples;
    header.positions = positions, header.pattern = "test", header.nested = true;
    header.background[0] = 0.1f, header.background[1] = 1e-7f, header.background[2] = -3e10f;
    header.source = "test \xc3\xa4", header.camera = "none";
    return header;
}

static int end(screendoor_trace *trace) {
    bool good = screendoor_trace_close(trace);
    if (!good) fprintf(stderr, "%s\n", screendoor_trace_error(trace));
    screendoor_trace_free(trace);
    return good ? 0 : 1;
}

static float real(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The next fragment of the file, 13 words. */
static bool next(FILE *file, screendoor_fragment *f) {
    uint32_t w[13];
    if (fread(w, sizeof w, 1, file) != 1) return false;
    f->x = w[0], f->y = w[1], f->coverage = (uint64_t)w[3] << 32 | w[2];
    f->z = w[4], f->dzdx = (int32_t)w[5], f->dzdy = (int32_t)w[6];
    f->r = real(w[7]), f->g = real(w[8]), f->b = real(w[9]), f->alpha = real(w[10]);
    f->primitive = w[11], f->object = w[12];
    return true;
}

static int write_trace(int count, char **words) {
    screendoor_header header = header_of(
        (uint32_t)atoi(words[4]), (uint32_t)atoi(words[5]), (uint32_t)atoi(words[6]));
    FILE *file = fopen(words[3], "rb");
    screendoor_trace *trace;
    screendoor_fragment few[100];
    size_t filled = 0;
    bool arrays = false;
    int i;
    if (file == NULL) return 2;
    for (i = 7; i < count; i++) {
        if (strcmp(words[i], "float") == 0) header.float_colours = true;
        if (strcmp(words[i], "unsealed") == 0) header.unsealed = true;
        if (strcmp(words[i], "encoded") == 0) header.encoded = true;
        if (strcmp(words[i], "view") == 0) header.view = &view;
        if (strcmp(words[i], "arrays") == 0) arrays = true;
        if (strcmp(words[i], "standard") == 0)
            header.positions = NULL, header.pattern = NULL, header.nested = false;
    }
    trace = screendoor_trace_open(words[2], &header);
    /* Nothing of the header is needed any more. */
    memset(positions, 0, sizeof positions);
    memset(&view, 0, sizeof view);
    while (next(file, &few[filled])) {
        if (!arrays) screendoor_trace_push(trace, &few[0]);
        else if (++filled == 100) screendoor_trace_push_array(trace, few, 100), filled = 0;
    }
    screendoor_trace_push_array(trace, few, filled);
    fclose(file);
    return end(trace);
}

static int write_raw(char **words) {
    screendoor_header header = header_of(
        (uint32_t)atoi(words[4]), (uint32_t)atoi(words[5]), (uint32_t)atoi(words[6]));
    size_t room = 1 << 20, count;
    screendoor_raw_fragment *raw = (screendoor_raw_fragment *)malloc(room * sizeof *raw);
    FILE *file = fopen(words[3], "rb");
    screendoor_trace *trace;
    if (file == NULL || raw == NULL) return 2;
    count = fread(raw, sizeof *raw, room, file);
    fclose(file);
    header.float_colours = true;
    trace = screendoor_trace_open(words[2], &header);
    screendoor_trace_push_raw(trace, raw, count);
    free(raw);
    return end(trace);
}

static const screendoor_fragment good = {1, 2, 1, 5, -6, 7, 0.5f, 0.5f, 0.5f, 0.5f, 3, 4};

static char path[2000];

static screendoor_trace *begin(
    const char *folder, const char *name, const screendoor_header *header) {
    snprintf(path, sizeof path, "%s/%s.arrow", folder, name);
    return screendoor_trace_open(path, header);
}

/* Says what a trace that has to fail says, which every call says again. */
static void refused(const char *name, screendoor_trace *trace) {
    char first[1000];
    snprintf(first, sizeof first, "%s", screendoor_trace_error(trace));
    if (screendoor_trace_push(trace, &good) || screendoor_trace_push_array(trace, &good, 1) ||
        screendoor_trace_push_raw(trace, NULL, 0) || screendoor_trace_close(trace) ||
        screendoor_trace_close(trace) || strcmp(first, screendoor_trace_error(trace)) != 0)
        printf("%s: it goes on\n", name);
    printf("%s: %s\n", name, first);
    screendoor_trace_free(trace);
}

/* A fragment that is refused after some that are good. */
static void fragment(const char *folder, const char *name, int before, screendoor_fragment bad) {
    screendoor_header header = header_of(8, 9, 4);
    screendoor_trace *trace = begin(folder, name, &header);
    for (; before > 0; before--)
        if (!screendoor_trace_push(trace, &good)) printf("%s: a good one is refused\n", name);
    if (screendoor_trace_push(trace, &bad)) printf("%s: it is taken\n", name);
    refused(name, trace);
}

static void header(const char *folder, const char *name, screendoor_header bad) {
    refused(name, begin(folder, name, &bad));
}

#define FRAGMENT(name, before, change)                                                             \
    {                                                                                              \
        screendoor_fragment f = good;                                                              \
        change;                                                                                    \
        fragment(folder, name, before, f);                                                         \
    }
#define HEADER(name, change)                                                                       \
    {                                                                                              \
        screendoor_header h = header_of(8, 9, 4);                                                  \
        h.view = &view;                                                                            \
        change;                                                                                    \
        header(folder, name, h);                                                                   \
    }

static int refuse(const char *folder) {
    screendoor_header fine = header_of(8, 9, 4);
    screendoor_trace *trace;
    int i;
    FRAGMENT("x", 2, f.x = 8)
    FRAGMENT("x-wide", 2, f.x = 65536 + 1)
    FRAGMENT("y", 2, f.y = 9)
    FRAGMENT("none", 2, f.coverage = 0)
    FRAGMENT("stray", 2, f.coverage = 16)
    FRAGMENT("stray-high", 2, f.coverage = (uint64_t)1 << 63)
    FRAGMENT("r", 2, f.r = (float)INFINITY)
    FRAGMENT("g", 2, f.g = (float)NAN)
    FRAGMENT("b", 2, f.b = -65520)
    FRAGMENT("alpha", 2, f.alpha = (float)NAN)
    FRAGMENT("alpha-more", 2, f.alpha = 1.0000001f)
    FRAGMENT("alpha-less", 2, f.alpha = -1e-30f)
    FRAGMENT("late", 70000, f.x = 8)
    FRAGMENT("kept", 2, f.x = 8)

    HEADER("width-none", h.width = 0)
    HEADER("width", h.width = 65537)
    HEADER("height", h.height = 70000)
    HEADER("samples", h.samples = 12)
    HEADER("samples-many", h.samples = 128)
    HEADER("positions", (h.samples = 32, h.positions = NULL))
    HEADER("position", positions[5] = 8)
    HEADER("background", h.background[1] = (float)NAN)
    HEADER("source", h.source = "caf\xe9")
    HEADER("camera", h.camera = "cut \xe2\x82")
    HEADER("pattern", h.pattern = "\xed\xa0\x80")
    HEADER("near", view.near_plane = 0)
    HEADER("far", view.far_plane = 0.25)
    HEADER("far-infinite", view.far_plane = (double)INFINITY)
    HEADER("world", view.world_to_view[5] = 1.01)
    HEADER("world-row", view.world_to_view[15] = 2)
    HEADER("world-nan", view.world_to_view[3] = (double)NAN)
    HEADER("clip-row", view.view_to_clip[15] = 1)
    HEADER("clip-kind", view.orthographic = true)
    HEADER("clip-x", view.view_to_clip[2] = 0.1)
    HEADER("clip-singular", view.view_to_clip[0] = 0)
    HEADER("clip-near", view.view_to_clip[14] *= 1.1)
    HEADER("clip-far", (view.near_plane = 1, view.view_to_clip[14] = view.view_to_clip[10]))

    trace = begin(folder, "no/such", &fine);
    refused("missing", trace);
    trace = begin(folder, "folder", &fine);
    refused("folder", trace);
    trace = begin(folder, "full", &fine);
    for (i = 0; i < 70000; i++) screendoor_trace_push(trace, &good);
    screendoor_trace_close(trace);
    refused("full", trace);
    trace = begin(folder, "abandoned", &fine);
    screendoor_trace_push(trace, &good);
    screendoor_trace_abandon(trace);
    refused("abandoned", trace);
    trace = begin(folder, "freed", &fine);
    screendoor_trace_push(trace, &good);
    screendoor_trace_free(trace);
    refused("null", NULL);

    trace = begin(folder, "closed", &fine);
    screendoor_trace_push(trace, &good);
    if (!screendoor_trace_close(trace) || !screendoor_trace_close(trace)) printf("closed: not\n");
    screendoor_trace_abandon(trace); /* which is too late */
    screendoor_trace_push(trace, &good);
    refused("closed", trace);
    return 0;
}

int main(int count, char **words) {
    setlocale(LC_ALL, "");
    if (count == 3 && strcmp(words[1], "refuse") == 0) return refuse(words[2]);
    if (count >= 7 && strcmp(words[1], "write") == 0) return write_trace(count, words);
    if (count == 7 && strcmp(words[1], "raw") == 0) return write_raw(words);
    fprintf(stderr, "see the top of check.c\n");
    return 2;
}
