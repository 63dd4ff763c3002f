/* screendoor_trace.h: writes the traces that screendoor replays, from C99 or C++11.
 *
 * A trace has one row for each fragment that a rasteriser hands on; docs/TRACE_FORMAT.md says
 * what is in it. Copy this file into your project, and in one source file write
 *
 *     #define SCREENDOOR_TRACE_IMPLEMENTATION
 *     #include "screendoor_trace.h"
 *
 * and in others just the second line. Nothing but the C standard library is needed, and
 * nothing is kept in global variables: threads can write a trace each. Then
 *
 *     screendoor_header header = {0}; // in C++: = {}
 *     header.width = 640, header.height = 480, header.samples = 4;
 *     screendoor_trace *trace = screendoor_trace_open("a.arrow", &header);
 *     screendoor_trace_push(trace, &fragment); // for each fragment
 *     if (!screendoor_trace_close(trace))
 *         fprintf(stderr, "%s\n", screendoor_trace_error(trace));
 *     screendoor_trace_free(trace);
 *
 * Errors: functions return false. The first error of a trace ends it: its file is removed, what
 * is called after fails too, and screendoor_trace_error says what was wrong. So it is enough to
 * look at what screendoor_trace_close returns.
 *
 * Memory: about 3 MB a trace, however many fragments there are.
 *
 * Licensed under MIT or Apache-2.0, as you like.
 */
#ifndef SCREENDOOR_TRACE_H
#define SCREENDOOR_TRACE_H

#ifndef __cplusplus
#include <stdbool.h>
#endif
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Where the camera stood. View space is right-handed: x to the right, y up, looking along -z.
 * Clip space is that of Direct3D, Metal and WebGPU: y up, depth z/w 0 at the near plane and 1
 * at the far one. (OpenGL and Vulkan: docs/TRACE_FORMAT.md, 'The view'.) Matrices are column by
 * column, element [4 * column + row], and multiply columns. */
typedef struct screendoor_view {
    bool orthographic;        /* else perspective */
    double near_plane;        /* distance along the view axis, in the scene's unit; */
    double far_plane;         /* near below far, in perspective above 0 */
    double world_to_view[16]; /* turns, may mirror, and moves: it keeps lengths */
    double view_to_clip[16];  /* the projection; of infinite or slanted planes there is no view */
} screendoor_view;

/* What a trace says about itself. Set all to zero first: what stays zero is the default. */
typedef struct screendoor_header {
    uint32_t width, height;      /* of the frame in pixels, 1 to 65536 */
    uint32_t samples;            /* per pixel: 1, 2, 4, 8, 16, 32 or 64 */
    const int8_t *positions;     /* x, y of each sample, one after the other, from the pixel's
                                    centre in 1/16 pixel: -8 to 7, y down; NULL: the standard
                                    ones of Direct3D and Vulkan, of up to 16 samples */
    const char *pattern;         /* name of these positions, for people; NULL: "custom", or
                                    "standard-4" and so on for the standard ones */
    bool nested;                 /* whether the first 2, 4, 8, ... of these positions are good
                                    patterns, too: then fewer samples can be replayed */
    float background[3];         /* colour behind everything, in the space of all colours */
    bool encoded;                /* colours are what an sRGB display is sent; else linear */
    bool float_colours;          /* colours are stored in single precision; else in half
                                    precision, rounded to nearest even: up to 65504 */
    bool unsealed;               /* without checksums and content hash; else with them, so that
                                    any damage to the file is found when it is read */
    const char *source, *camera; /* what was captured and from where, for people, in UTF-8;
                                    NULL: "unknown" */
    const screendoor_view *view; /* the camera in numbers; NULL: not said */
} screendoor_header;

/* What one primitive leaves in one pixel. Fragments of a pixel are pushed in the order of
 * drawing; of different pixels in any order. */
typedef struct screendoor_fragment {
    uint32_t x, y;      /* the pixel, from the frame's left and top */
    uint64_t coverage;  /* bit s: sample s is covered; never 0 */
    uint32_t z;         /* depth at the pixel's centre: 0 near, 2^32 - 1 far */
    int32_t dzdx, dzdy; /* how it changes per pixel to the right and down, in the same unit */
    float r, g, b;      /* finite, not multiplied by alpha */
    float alpha;        /* opacity, 0 to 1 */
    uint32_t primitive; /* the triangle's number: no two that meet in a pixel share one */
    uint32_t object;    /* the object's number */
} screendoor_fragment;

/* A fragment as a shader can record it: 11 words, in the order of screendoor's append.wgsl. */
typedef struct screendoor_raw_fragment {
    uint32_t pixel;             /* the pixel's column, and its row times 65536 */
    uint32_t primitive, object; /* the primitive's number rises in the order of drawing */
    uint32_t coverage;          /* SV_Coverage, gl_SampleMaskIn[0]: of up to 32 samples */
    float z, dzdx, dzdy;        /* depth at the pixel's centre, 0 near to 1 far; its derivatives */
    float red, green, blue, alpha;
} screendoor_raw_fragment;

typedef struct screendoor_trace screendoor_trace;

/* Begins a trace. It is written to `path` with ".partial" after it, and has its own name once it
 * is closed; until then a file that stands there stays as it is. Two traces of one path must not
 * be written at once. NULL where memory is out: all functions take that, and fail. What is
 * wrong with the header or the path is kept as the trace's error. Nothing that the header points
 * to is needed after. */
screendoor_trace *screendoor_trace_open(const char *path, const screendoor_header *header);

/* Adds fragments. Values that no trace may hold are refused: x or y outside the frame, coverage
 * that is empty or has samples that do not exist, colours that are not finite or (in half
 * precision) beyond 65504, alpha that is not 0 to 1. The error says the row, from 0, and the
 * column. */
bool screendoor_trace_push(screendoor_trace *trace, const screendoor_fragment *fragment);
bool screendoor_trace_push_array(
    screendoor_trace *trace, const screendoor_fragment *fragments, size_t count);

/* Adds the fragments of a buffer that shaders appended to in any order: sorts them in place by
 * primitive, then by row, then by column. Of several that one primitive left in one pixel, as
 * clipping makes them, coverage is put together, and the rest is that of the one that covers
 * most. Depths become whole as screendoor_depth does it, alpha is clamped to 0 to 1. Several
 * buffers of one frame: later ones hold later primitives. */
bool screendoor_trace_push_raw(screendoor_trace *trace, screendoor_raw_fragment *raw, size_t count);

/* Finishes the file and gives it its name, in place of a file that stood there. True: it stands
 * there whole. The trace takes no more; closing it twice says the same again. */
bool screendoor_trace_close(screendoor_trace *trace);

/* Removes the file of a trace that is not closed. */
void screendoor_trace_abandon(screendoor_trace *trace);

/* What was wrong, in a line; "" where nothing was. Good until screendoor_trace_free. */
const char *screendoor_trace_error(const screendoor_trace *trace);

/* Frees the trace; one that is not closed is abandoned. */
void screendoor_trace_free(screendoor_trace *trace);

/* Sets a fragment's z, dzdx and dzdy of a depth from 0 to 1 at the pixel's centre and its
 * derivatives, as a fragment shader has them. A plane that leaves that range at the centre, or
 * half of it within a pixel, becomes flat. */
void screendoor_depth(screendoor_fragment *fragment, float z, float dzdx, float dzdy);

/* The standard positions of 1, 2, 4, 8 or 16 samples, as a header has them; else NULL. */
const int8_t *screendoor_standard_positions(uint32_t samples);

#ifdef __cplusplus
}
#endif
#endif /* SCREENDOOR_TRACE_H */

#ifdef SCREENDOOR_TRACE_IMPLEMENTATION
#ifndef SCREENDOOR_TRACE_IMPLEMENTED
#define SCREENDOOR_TRACE_IMPLEMENTED

#include <errno.h>
#include <float.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if FLT_RADIX != 2 || FLT_MANT_DIG != 24 || DBL_MANT_DIG != 53
#error "screendoor_trace.h needs float and double of 32 and 64 bits, as IEEE 754 has them"
#endif
#ifdef _MSC_VER
#pragma warning(push)
#pragma warning(disable : 4996) /* fopen, strerror */
#endif

/* ---- Bytes. All that is stored is little-endian, whatever the machine. ---- */

static void screendoor_i_store(unsigned char *at, uint64_t value, size_t size) {
    size_t i;
    for (i = 0; i < size; i++) at[i] = (unsigned char)(value >> (8 * i) & 0xff);
}

static uint32_t screendoor_i_load(const unsigned char *at) {
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static uint32_t screendoor_i_bits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Numbers are looked at as bits, so that -ffast-math does not change what is refused. */
static bool screendoor_i_finite(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits >> 52 & 0x7ff) != 0x7ff;
}

/* Bytes that grow. Once memory was out, nothing more is added. */
typedef struct {
    unsigned char *data;
    size_t length, room;
    bool failed;
} screendoor_i_bytes;

/* Room for `size` more, zeros; NULL where there is none. */
static unsigned char *screendoor_i_grow(screendoor_i_bytes *bytes, size_t size) {
    if (!bytes->failed && size > bytes->room - bytes->length) {
        size_t room = bytes->length + size + bytes->length / 2 + 256;
        unsigned char *data = room < bytes->length ? NULL
                                                   : (unsigned char *)realloc(bytes->data, room);
        bytes->failed = data == NULL;
        if (data != NULL) bytes->data = data, bytes->room = room;
    }
    if (bytes->failed || size == 0) return NULL;
    memset(bytes->data + bytes->length, 0, size);
    bytes->length += size;
    return bytes->data + bytes->length - size;
}

static void screendoor_i_put(screendoor_i_bytes *bytes, const void *data, size_t size) {
    unsigned char *at = screendoor_i_grow(bytes, size);
    if (at != NULL) memcpy(at, data, size);
}

static void screendoor_i_number(screendoor_i_bytes *bytes, uint64_t value, size_t size) {
    unsigned char *at = screendoor_i_grow(bytes, size);
    if (at != NULL) screendoor_i_store(at, value, size);
}

/* ---- Flatbuffers, from front to back: a table stands after what points to it. ---- */

/* Zeros, until the length is `rest` more than a multiple of `align`. */
static void screendoor_i_align(screendoor_i_bytes *bytes, size_t align, size_t rest) {
    screendoor_i_grow(bytes, (align - bytes->length % align + rest) % align);
}

/* A table of zeros, and where it is. Each of `slots` is a field's size, or '.' for one that is
 * not there. The vtable stands before it. */
static size_t screendoor_i_table(screendoor_i_bytes *bytes, const char *slots) {
    size_t count = strlen(slots), vtable = 4 + 2 * count, end = 4, size, i;
    size_t places[8] = {0};
    for (size = 8; size > 0; size /= 2)
        for (i = 0; i < count; i++)
            if (slots[i] == (char)('0' + (int)size)) places[i] = end, end += size;
    screendoor_i_align(bytes, 8, (4 + 8 - vtable % 8) % 8);
    screendoor_i_number(bytes, vtable, 2);
    screendoor_i_number(bytes, end, 2);
    for (i = 0; i < count; i++) screendoor_i_number(bytes, places[i], 2);
    screendoor_i_number(bytes, vtable, 4);
    screendoor_i_grow(bytes, end - 4);
    return bytes->length - end;
}

/* The place of a table's field. */
static size_t screendoor_i_slot(const screendoor_i_bytes *bytes, size_t table, size_t slot) {
    size_t entry;
    if (bytes->failed) return 0;
    entry = table - screendoor_i_load(bytes->data + table) + 4 + 2 * slot;
    return table + bytes->data[entry] + 256u * bytes->data[entry + 1];
}

static void screendoor_i_set(screendoor_i_bytes *bytes, size_t place, uint64_t value, size_t size) {
    if (!bytes->failed) screendoor_i_store(bytes->data + place, value, size);
}

static void screendoor_i_field(
    screendoor_i_bytes *bytes, size_t table, size_t slot, uint64_t value, size_t size) {
    screendoor_i_set(bytes, screendoor_i_slot(bytes, table, slot), value, size);
}

/* Lets the offset at `place`, or in a table's field, point to `target`. */
static void screendoor_i_point(screendoor_i_bytes *bytes, size_t place, size_t target) {
    screendoor_i_set(bytes, place, target - place, 4);
}

static void screendoor_i_link(screendoor_i_bytes *bytes, size_t table, size_t slot, size_t target) {
    screendoor_i_point(bytes, screendoor_i_slot(bytes, table, slot), target);
}

static size_t screendoor_i_string(screendoor_i_bytes *bytes, const char *text) {
    size_t length = strlen(text), at;
    screendoor_i_align(bytes, 4, 0);
    at = bytes->length;
    screendoor_i_number(bytes, length, 4);
    screendoor_i_put(bytes, text, length + 1);
    return at;
}

/* A vector of zeros whose elements are aligned to `align`. */
static size_t screendoor_i_vector(
    screendoor_i_bytes *bytes, size_t count, size_t size, size_t align) {
    screendoor_i_align(bytes, align, align - 4);
    screendoor_i_number(bytes, count, 4);
    screendoor_i_grow(bytes, count * size);
    return bytes->length - count * size - 4;
}

/* ---- CRC-32 ---- */

static uint32_t screendoor_i_crc(
    const uint32_t table[256], uint32_t crc, const void *data, size_t size) {
    const unsigned char *at = (const unsigned char *)data;
    crc = ~crc;
    while (size-- > 0) crc = table[(crc ^ *at++) & 0xff] ^ crc >> 8;
    return ~crc;
}

static uint32_t screendoor_i_crc_line(
    const uint32_t table[256], uint32_t crc, const char *key, const char *value) {
    crc = screendoor_i_crc(table, crc, key, strlen(key));
    crc = screendoor_i_crc(table, crc, "=", 1);
    crc = screendoor_i_crc(table, crc, value, strlen(value));
    return screendoor_i_crc(table, crc, "\n", 1);
}

/* ---- BLAKE3 ---- */

enum {
    SCREENDOOR_I_START = 1,
    SCREENDOOR_I_END = 2,
    SCREENDOOR_I_PARENT = 4,
    SCREENDOOR_I_ROOT = 8
};

typedef struct {
    uint32_t stack[54][8]; /* of whole subtrees, the largest first */
    uint32_t value[8];     /* of the chunk that is under way */
    unsigned char block[64];
    uint64_t chunk;
    uint32_t depth, used, blocks;
} screendoor_i_blake3;

static const uint32_t screendoor_i_iv[8] = {
    0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};

static void screendoor_i_compress(uint32_t value[8], const unsigned char block[64],
    uint64_t counter, uint32_t length, uint32_t flags) {
    static const unsigned char order[7][16] = {
        {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
        {2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8},
        {3, 4, 10, 12, 13, 2, 7, 14, 6, 5, 9, 0, 11, 15, 8, 1},
        {10, 7, 12, 9, 14, 3, 13, 15, 4, 0, 11, 2, 5, 8, 1, 6},
        {12, 13, 9, 11, 15, 10, 14, 8, 7, 2, 5, 3, 0, 1, 6, 4},
        {9, 14, 11, 5, 8, 12, 15, 1, 13, 3, 0, 10, 2, 6, 4, 7},
        {11, 15, 5, 0, 1, 9, 8, 6, 14, 10, 2, 12, 3, 4, 7, 13}};
    uint32_t s[16], m[16];
    int i;
    for (i = 0; i < 8; i++) s[i] = value[i];
    for (i = 0; i < 4; i++) s[8 + i] = screendoor_i_iv[i];
    s[12] = (uint32_t)counter, s[13] = (uint32_t)(counter >> 32), s[14] = length, s[15] = flags;
    for (i = 0; i < 16; i++) m[i] = screendoor_i_load(block + 4 * i);
#define SCREENDOOR_I_TURN(a, b, n) (a ^= b, a = a >> n | a << (32 - n))
#define SCREENDOOR_I_MIX(a, b, c, d, k)                                                            \
    (s[a] += s[b] + m[order[i][k]], SCREENDOOR_I_TURN(s[d], s[a], 16), s[c] += s[d],               \
        SCREENDOOR_I_TURN(s[b], s[c], 12), s[a] += s[b] + m[order[i][k + 1]],                      \
        SCREENDOOR_I_TURN(s[d], s[a], 8), s[c] += s[d], SCREENDOOR_I_TURN(s[b], s[c], 7))
    for (i = 0; i < 7; i++) {
        SCREENDOOR_I_MIX(0, 4, 8, 12, 0);
        SCREENDOOR_I_MIX(1, 5, 9, 13, 2);
        SCREENDOOR_I_MIX(2, 6, 10, 14, 4);
        SCREENDOOR_I_MIX(3, 7, 11, 15, 6);
        SCREENDOOR_I_MIX(0, 5, 10, 15, 8);
        SCREENDOOR_I_MIX(1, 6, 11, 12, 10);
        SCREENDOOR_I_MIX(2, 7, 8, 13, 12);
        SCREENDOOR_I_MIX(3, 4, 9, 14, 14);
    }
#undef SCREENDOOR_I_MIX
#undef SCREENDOOR_I_TURN
    for (i = 0; i < 8; i++) value[i] = s[i] ^ s[i + 8];
}

static void screendoor_i_join(uint32_t left[8], const uint32_t right[8], uint32_t flags) {
    unsigned char block[64];
    size_t i;
    for (i = 0; i < 8; i++) screendoor_i_store(block + 4 * i, left[i], 4);
    for (i = 0; i < 8; i++) screendoor_i_store(block + 32 + 4 * i, right[i], 4);
    memcpy(left, screendoor_i_iv, sizeof screendoor_i_iv);
    screendoor_i_compress(left, block, 0, 64, SCREENDOOR_I_PARENT | flags);
}

static void screendoor_i_hash_init(screendoor_i_blake3 *hash) {
    memset(hash, 0, sizeof *hash);
    memcpy(hash->value, screendoor_i_iv, sizeof screendoor_i_iv);
}

static void screendoor_i_hash(screendoor_i_blake3 *hash, const void *data, size_t size) {
    const unsigned char *at = (const unsigned char *)data;
    while (size > 0) {
        size_t part;
        if (hash->used == 64) { /* and more comes: it is not the last block */
            uint32_t first = hash->blocks == 0 ? SCREENDOOR_I_START : 0;
            uint32_t last = hash->blocks == 15 ? SCREENDOOR_I_END : 0;
            screendoor_i_compress(hash->value, hash->block, hash->chunk, 64, first | last);
            hash->used = 0, hash->blocks++;
            if (last != 0) {
                uint64_t whole = ++hash->chunk;
                memcpy(hash->stack[hash->depth++], hash->value, sizeof hash->value);
                for (; (whole & 1) == 0; whole >>= 1, hash->depth--)
                    screendoor_i_join(
                        hash->stack[hash->depth - 2], hash->stack[hash->depth - 1], 0);
                hash->blocks = 0;
                memcpy(hash->value, screendoor_i_iv, sizeof screendoor_i_iv);
            }
        }
        part = 64 - hash->used < size ? 64 - hash->used : size;
        memcpy(hash->block + hash->used, at, part);
        hash->used += (uint32_t)part, at += part, size -= part;
    }
}

static void screendoor_i_hash_line(screendoor_i_blake3 *hash, const char *key, const char *value) {
    screendoor_i_hash(hash, key, strlen(key));
    screendoor_i_hash(hash, "=", 1);
    screendoor_i_hash(hash, value, strlen(value));
    screendoor_i_hash(hash, "\n", 1);
}

/* The hash as 64 hexadecimal digits. */
static void screendoor_i_hash_end(screendoor_i_blake3 *hash, char hex[65]) {
    uint32_t flags = (hash->blocks == 0 ? SCREENDOOR_I_START : 0) | SCREENDOOR_I_END;
    uint32_t depth = hash->depth, i;
    memset(hash->block + hash->used, 0, 64 - hash->used);
    screendoor_i_compress(hash->value, hash->block, hash->chunk, hash->used,
        flags | (depth == 0 ? SCREENDOOR_I_ROOT : 0));
    while (depth-- > 0) {
        screendoor_i_join(hash->stack[depth], hash->value, depth == 0 ? SCREENDOOR_I_ROOT : 0);
        memcpy(hash->value, hash->stack[depth], sizeof hash->value);
    }
    for (i = 0; i < 32; i++) {
        uint32_t byte = hash->value[i / 4] >> (8 * (i % 4));
        hex[2 * i] = "0123456789abcdef"[byte >> 4 & 15];
        hex[2 * i + 1] = "0123456789abcdef"[byte & 15];
    }
    hex[64] = '\0';
}

/* ---- Numbers ---- */

/* Half precision, rounded to nearest even: its bits. */
static uint32_t screendoor_i_half(float value) {
    uint32_t bits = screendoor_i_bits(value), sign = bits >> 16 & 0x8000;
    uint32_t size = bits & 0x7fffffff, whole, rest, middle;
    if (size >= 0x47800000) return sign | 0x7c00 | (size > 0x7f800000 ? 0x200 : 0);
    if (size >= 0x38800000) {
        whole = (size - 0x38000000) >> 13, rest = size & 0x1fff, middle = 0x1000;
    } else if (size >= 0x33000000) { /* in units of 2^-24 */
        uint32_t shift = 126 - (size >> 23), digits = (size & 0x7fffff) | 0x800000;
        middle = (uint32_t)1 << (shift - 1);
        whole = digits >> shift, rest = digits & (2 * middle - 1);
    } else {
        return sign;
    }
    return sign | (whole + (rest > middle || (rest == middle && (whole & 1) != 0) ? 1 : 0));
}

/* Writes the fewest digits that are read back as the same number, of single precision without
 * an exponent; returns their end. Whatever the locale: what it puts for the point is passed over,
 * and in between the same locale reads what it wrote. */
static char *screendoor_i_decimal(char *out, double value, bool single) {
    char text[64], digits[24] = "0";
    const char *at;
    int precision, count = 0, exponent, i, most = single ? 9 : 17;
    for (precision = 1; precision <= most; precision++) {
        volatile float as_float;
        volatile double as_double;
        snprintf(text, sizeof text, "%.*e", precision - 1, value);
        as_float = strtof(text, NULL);
        as_double = strtod(text, NULL);
        if (single ? as_float == (float)value : as_double == value) break;
    }
    if (text[0] == '-') *out++ = '-';
    for (at = text; *at != 'e' && *at != '\0'; at++)
        if (*at >= '0' && *at <= '9' && count < 18) digits[count++] = *at;
    exponent = *at == 'e' ? atoi(at + 1) : 0;
    if (!single && (exponent < -4 || exponent >= 16)) {
        *out++ = digits[0];
        if (count > 1) *out++ = '.';
        for (i = 1; i < count; i++) *out++ = digits[i];
        return out + snprintf(out, 16, "e%d", exponent);
    }
    for (i = exponent < 0 ? exponent : 0; i < count || i <= exponent; i++) {
        *out++ = i >= 0 && i < count ? digits[i] : '0';
        if (i == exponent && i + 1 < count) *out++ = '.';
        if (i == exponent && i + 1 >= count && !single) *out++ = '.', *out++ = '0';
    }
    *out = '\0';
    return out;
}

static bool screendoor_i_is_utf8(const char *text) {
    const unsigned char *at = (const unsigned char *)text;
    while (*at != '\0') {
        int more = *at < 0x80 ? 0 : *at < 0xe0 ? 1 : *at < 0xf0 ? 2 : 3, i;
        uint32_t code = *at & (more == 0 ? 0x7fu : 0x3fu >> more);
        if ((*at >= 0x80 && *at < 0xc2) || *at > 0xf4) return false;
        for (i = 1; i <= more; i++) {
            if ((at[i] & 0xc0) != 0x80) return false; /* also at the text's end */
            code = code << 6 | (at[i] & 0x3fu);
        }
        if (more > 1 && (code < (more == 2 ? 0x800u : 0x10000u) || code > 0x10ffff ||
                            (code >= 0xd800 && code < 0xe000)))
            return false;
        at += 1 + more;
    }
    return true;
}

/* ---- The trace ---- */

enum { SCREENDOOR_I_ROWS = 65536, SCREENDOOR_I_COLUMNS = 12, SCREENDOOR_I_ENTRIES = 20 };

/* 'u' unsigned, 'i' signed, 'f' real. */
static const char screendoor_i_kinds[] = "uuuuiiffffuu";
static const char *const screendoor_i_names[SCREENDOOR_I_COLUMNS] = {
    "x", "y", "coverage", "z", "dzdx", "dzdy", "r", "g", "b", "alpha", "primitive", "object"};

struct screendoor_trace {
    char *path, *partial, error[640];
    FILE *file;
    bool sealed, failed, closed, begun;
    uint32_t width, height, samples, batch; /* rows of the batch under way */
    uint64_t rows, written;                 /* what came before it */
    size_t sizes[SCREENDOOR_I_COLUMNS];
    unsigned char *columns[SCREENDOOR_I_COLUMNS];
    screendoor_i_blake3 header_hash, hashes[SCREENDOOR_I_COLUMNS];
    uint32_t table[256], crc;
    const char *keys[SCREENDOOR_I_ENTRIES]; /* of the schema's metadata, sorted */
    size_t values[SCREENDOOR_I_ENTRIES];    /* within `text` */
    size_t entries;
    screendoor_i_bytes text, message, batches, seals; /* `batches` as the footer has them */
};

static void screendoor_i_drop(screendoor_trace *trace) {
    if (trace->file != NULL) fclose(trace->file);
    if (trace->begun) remove(trace->partial);
    trace->file = NULL, trace->begun = false;
}

/* Keeps the first error and removes the file; false. */
static bool screendoor_i_fail(screendoor_trace *trace, const char *format, ...) {
    if (!trace->failed) {
        va_list values;
        int length = snprintf(trace->error, sizeof trace->error, "%.400s: ", trace->path);
        va_start(values, format);
        vsnprintf(trace->error + length, sizeof trace->error - (size_t)length, format, values);
        va_end(values);
        trace->failed = true;
        screendoor_i_drop(trace);
    }
    return false;
}

static bool screendoor_i_io(screendoor_trace *trace, const char *action) {
    return screendoor_i_fail(trace, "cannot %s: %s", action, strerror(errno));
}

static bool screendoor_i_memory(screendoor_trace *trace) {
    return screendoor_i_fail(trace, "out of memory");
}

static bool screendoor_i_write(screendoor_trace *trace, const void *data, size_t size) {
    if (trace->failed) return false;
    if (size > 0 && fwrite(data, 1, size, trace->file) != size)
        return screendoor_i_io(trace, "write");
    if (trace->sealed) trace->crc = screendoor_i_crc(trace->table, trace->crc, data, size);
    trace->written += size;
    return true;
}

/* Ends a stretch of the file that has a checksum of its own. */
static void screendoor_i_seal(screendoor_trace *trace, uint32_t rows) {
    char text[64];
    int length = snprintf(text, sizeof text, "%s%u:%llu:%08x", rows == 0 ? "" : " ", (unsigned)rows,
        (unsigned long long)trace->written, (unsigned)trace->crc);
    if (trace->sealed) screendoor_i_put(&trace->seals, text, (size_t)length);
    trace->crc = 0;
}

static void screendoor_i_entry(screendoor_trace *trace, const char *key, const char *value) {
    trace->keys[trace->entries] = key;
    trace->values[trace->entries++] = trace->text.length;
    screendoor_i_put(&trace->text, value, strlen(value) + 1);
}

/* Begins a message of Arrow's, and returns its table: version 5, `type` 1 for a schema and 3 for
 * a batch. */
static size_t screendoor_i_begin(screendoor_i_bytes *message, uint64_t type, uint64_t body) {
    size_t table;
    message->length = 0;
    screendoor_i_number(message, 0, 4);
    table = screendoor_i_table(message, "2148");
    screendoor_i_point(message, 0, table);
    screendoor_i_field(message, table, 0, 4, 2);
    screendoor_i_field(message, table, 1, type, 1);
    screendoor_i_field(message, table, 3, body, 8);
    return table;
}

/* Writes a message, so that what follows is aligned to 64 bytes; returns its bytes. */
static size_t screendoor_i_end(screendoor_trace *trace) {
    screendoor_i_bytes *message = &trace->message;
    unsigned char head[8] = {0xff, 0xff, 0xff, 0xff};
    screendoor_i_align(message, 64, (size_t)((128 - 8 - trace->written % 64) % 64));
    if (message->failed) return screendoor_i_memory(trace), (size_t)0;
    screendoor_i_store(head + 4, message->length, 4);
    screendoor_i_write(trace, head, 8);
    screendoor_i_write(trace, message->data, message->length);
    return 8 + message->length;
}

/* Key and value texts as the vector in the slot of a table. */
static size_t screendoor_i_metadata(
    screendoor_i_bytes *out, size_t table, size_t slot, size_t count) {
    size_t vector = screendoor_i_vector(out, count, 4, 4);
    screendoor_i_link(out, table, slot, vector);
    return vector + 4;
}

/* Returns where the value's characters are. */
static size_t screendoor_i_pair(
    screendoor_i_bytes *out, size_t place, const char *key, const char *value) {
    size_t pair = screendoor_i_table(out, "44"), at;
    screendoor_i_point(out, place, pair);
    at = screendoor_i_string(out, key);
    screendoor_i_link(out, pair, 0, at);
    at = screendoor_i_string(out, value);
    screendoor_i_link(out, pair, 1, at);
    return at + 4;
}

/* The schema, to which the slot of a table points. */
static void screendoor_i_schema(screendoor_trace *trace, size_t table, size_t slot) {
    screendoor_i_bytes *out = &trace->message;
    size_t schema = screendoor_i_table(out, ".44"), fields, place, i;
    screendoor_i_link(out, table, slot, schema);
    fields = screendoor_i_vector(out, SCREENDOOR_I_COLUMNS, 4, 4);
    screendoor_i_link(out, schema, 1, fields);
    for (i = 0; i < SCREENDOOR_I_COLUMNS; i++) {
        bool real = screendoor_i_kinds[i] == 'f';
        /* Name, nullable, kind of type, type, dictionary, children. */
        size_t field = screendoor_i_table(out, "4114.4"), at;
        screendoor_i_point(out, fields + 4 + 4 * i, field);
        screendoor_i_field(out, field, 2, real ? 3 : 2, 1);
        at = screendoor_i_string(out, screendoor_i_names[i]);
        screendoor_i_link(out, field, 0, at);
        at = screendoor_i_table(out, real ? "2" : "41");
        screendoor_i_link(out, field, 3, at);
        if (real) { /* 0 half, 1 single */
            screendoor_i_field(out, at, 0, trace->sizes[i] / 4, 2);
        } else {
            screendoor_i_field(out, at, 0, 8 * trace->sizes[i], 4);
            screendoor_i_field(out, at, 1, screendoor_i_kinds[i] == 'i', 1);
        }
        at = screendoor_i_vector(out, 0, 4, 4);
        screendoor_i_link(out, field, 5, at);
    }
    place = screendoor_i_metadata(out, schema, 2, trace->entries);
    for (i = 0; i < trace->entries; i++)
        screendoor_i_pair(
            out, place + 4 * i, trace->keys[i], (const char *)trace->text.data + trace->values[i]);
}

static bool screendoor_i_flush(screendoor_trace *trace) {
    static const unsigned char zeros[64] = {0};
    screendoor_i_bytes *out = &trace->message;
    uint64_t offset = trace->written, body = 0;
    size_t table, batch, nodes, buffers, message, i;
    if (trace->batch == 0 || trace->failed) return !trace->failed;
    for (i = 0; i < SCREENDOOR_I_COLUMNS; i++)
        body += (trace->batch * trace->sizes[i] + 63) / 64 * 64;
    table = screendoor_i_begin(out, 3, body);
    batch = screendoor_i_table(out, "844");
    screendoor_i_link(out, table, 2, batch);
    screendoor_i_field(out, batch, 0, trace->batch, 8);
    nodes = screendoor_i_vector(out, SCREENDOOR_I_COLUMNS, 16, 8);
    screendoor_i_link(out, batch, 1, nodes);
    buffers = screendoor_i_vector(out, 2 * SCREENDOOR_I_COLUMNS, 16, 8);
    screendoor_i_link(out, batch, 2, buffers);
    for (i = 0, body = 0; i < SCREENDOOR_I_COLUMNS; i++) {
        size_t bytes = trace->batch * trace->sizes[i], pair = buffers + 4 + 32 * i;
        screendoor_i_set(out, nodes + 4 + 16 * i, trace->batch, 8);
        screendoor_i_set(out, pair, body, 8); /* no validity bits */
        screendoor_i_set(out, pair + 16, body, 8);
        screendoor_i_set(out, pair + 24, bytes, 8);
        body += (bytes + 63) / 64 * 64;
    }
    message = screendoor_i_end(trace);
    for (i = 0; i < SCREENDOOR_I_COLUMNS; i++) {
        size_t bytes = trace->batch * trace->sizes[i];
        screendoor_i_write(trace, trace->columns[i], bytes);
        screendoor_i_write(trace, zeros, (64 - bytes % 64) % 64);
        if (trace->sealed) screendoor_i_hash(&trace->hashes[i], trace->columns[i], bytes);
    }
    screendoor_i_number(&trace->batches, offset, 8);
    screendoor_i_number(&trace->batches, message, 8);
    screendoor_i_number(&trace->batches, body, 8);
    screendoor_i_seal(trace, trace->batch);
    trace->rows += trace->batch, trace->batch = 0;
    if (trace->batches.failed || trace->seals.failed) return screendoor_i_memory(trace);
    return !trace->failed;
}

/* All that follows the last batch. */
static bool screendoor_i_tail(screendoor_trace *trace) {
    screendoor_i_bytes *out = &trace->message;
    unsigned char end[10] = {0, 0, 0, 0, 'A', 'R', 'R', 'O', 'W', '1'};
    unsigned char mark[8] = {0xff, 0xff, 0xff, 0xff};
    const size_t count = trace->batches.length / 24;
    size_t footer, at, place, digits[2] = {0, 0}, i;
    char content[65], rows[24], text[16];
    uint32_t tail, seal = 0;

    screendoor_i_put(&trace->seals, "", 1);
    if (trace->seals.failed) return screendoor_i_memory(trace);
    snprintf(rows, sizeof rows, "%llu", (unsigned long long)trace->rows);
    out->length = 0;
    screendoor_i_number(out, 0, 4);
    /* Version, schema, dictionaries, batches, metadata. */
    footer = screendoor_i_table(out, trace->sealed ? "24444" : "2444");
    screendoor_i_point(out, 0, footer);
    screendoor_i_field(out, footer, 0, 4, 2);
    screendoor_i_schema(trace, footer, 1);
    at = screendoor_i_vector(out, 0, 24, 8);
    screendoor_i_link(out, footer, 2, at);
    at = screendoor_i_vector(out, 0, 24, 8);
    screendoor_i_set(out, at, count, 4);
    screendoor_i_put(out, trace->batches.data, 24 * count);
    screendoor_i_link(out, footer, 3, at);
    if (trace->sealed) {
        const char *const keys[5] = {"screendoor.blocks", "screendoor.content", "screendoor.rows",
            "screendoor.tail", "screendoor.seal"};
        const char *const values[5] = {
            (const char *)trace->seals.data, content, rows, "00000000", "00000000"};
        screendoor_i_hash_line(&trace->header_hash, "rows", rows);
        for (i = 0; i < SCREENDOOR_I_COLUMNS; i++) {
            screendoor_i_hash_end(&trace->hashes[i], content);
            screendoor_i_hash_line(&trace->header_hash, screendoor_i_names[i], content);
        }
        screendoor_i_hash_end(&trace->header_hash, content);
        place = screendoor_i_metadata(out, footer, 4, 5);
        for (i = 0; i < 5; i++) {
            at = screendoor_i_pair(out, place + 4 * i, keys[i], values[i]);
            if (i >= 3) digits[i - 3] = at;
            if (i < 3) seal = screendoor_i_crc_line(trace->table, seal, keys[i], values[i]);
        }
    }
    screendoor_i_align(out, 8, 0);
    if (out->failed) return screendoor_i_memory(trace);
    if (out->length > INT32_MAX) return screendoor_i_fail(trace, "it has too many fragments");
    screendoor_i_store(end, out->length, 4);
    if (trace->sealed) {
        tail = screendoor_i_crc(trace->table, 0, mark, sizeof mark);
        tail = screendoor_i_crc(trace->table, tail, out->data, out->length);
        tail = screendoor_i_crc(trace->table, tail, end, sizeof end);
        snprintf(text, sizeof text, "%08x", (unsigned)tail);
        memcpy(out->data + digits[0], text, 8);
        seal = screendoor_i_crc_line(trace->table, seal, "screendoor.tail", text);
        snprintf(text, sizeof text, "%08x", (unsigned)seal);
        memcpy(out->data + digits[1], text, 8);
    }
    screendoor_i_write(trace, mark, sizeof mark);
    screendoor_i_write(trace, out->data, out->length);
    return screendoor_i_write(trace, end, sizeof end);
}

/* ---- The header ---- */

static double screendoor_i_abs(double value) { return value < 0 ? -value : value; }

static double screendoor_i_view_depth(const screendoor_view *view, double distance) {
    const double *m = view->view_to_clip;
    double scale = view->orthographic ? m[15] : -m[11];
    return (m[14] / scale - m[10] / scale * distance) / (view->orthographic ? 1.0 : distance);
}

/* Which rule of docs/TRACE_FORMAT.md, 'The view', is broken; NULL where none is. */
static const char *screendoor_i_view_fault(const screendoor_view *view) {
    const double *m = view->world_to_view, *p = view->view_to_clip;
    const double near_plane = view->near_plane, far_plane = view->far_plane;
    double most = 0, allowed, a = screendoor_i_abs(near_plane), determinant;
    size_t i, j;
    for (i = 0; i < 16; i++) {
        if (!screendoor_i_finite(m[i])) return "world_to_view is not finite";
        if (!screendoor_i_finite(p[i])) return "view_to_clip is not finite";
    }
    if (!screendoor_i_finite(near_plane) || !screendoor_i_finite(far_plane))
        return "near_plane or far_plane is not finite";
    if (near_plane >= far_plane || !screendoor_i_finite(far_plane - near_plane))
        return "near_plane is not below far_plane";
    if (!view->orthographic && near_plane <= 0) return "near_plane is not before the eye";
    for (i = 0; i < 3; i++) {
        for (j = i; j < 3; j++) {
            const double *b = m + 4 * i, *c = m + 4 * j;
            double off = b[0] * c[0] + b[1] * c[1] + b[2] * c[2] - (i == j ? 1 : 0);
            if (!(screendoor_i_abs(off) <= 1e-5))
                return "world_to_view does more than turn, mirror and move";
        }
    }
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
        return "world_to_view's last row is not 0 0 0 1";
    if (p[3] != 0 || p[7] != 0 || (view->orthographic ? p[11] != 0 : p[15] != 0) ||
        (view->orthographic ? p[15] <= 0 : p[11] >= 0))
        return view->orthographic ? "view_to_clip's last row is not 0 0 0 k"
                                  : "view_to_clip's last row is not 0 0 -k 0";
    if (p[2] != 0 || p[6] != 0) return "view_to_clip's depth depends on x or y";
    for (i = 0; i < 6; i++)
        if (i % 4 < 2 && screendoor_i_abs(p[i]) > most) most = screendoor_i_abs(p[i]);
    determinant = p[0] * p[5] - p[4] * p[1];
    if (!(screendoor_i_abs(determinant) > 1e-12 * most * most)) return "view_to_clip is singular";
    if (screendoor_i_abs(far_plane) > a) a = screendoor_i_abs(far_plane);
    allowed = 1e-6 * a / (far_plane - near_plane);
    if (allowed > 0.01) allowed = 0.01;
    if (!(screendoor_i_abs(screendoor_i_view_depth(view, near_plane)) <= allowed))
        return "view_to_clip does not give near_plane the depth 0";
    if (!(screendoor_i_abs(screendoor_i_view_depth(view, far_plane) - 1) <= allowed))
        return "view_to_clip does not give far_plane the depth 1";
    return NULL;
}

const int8_t *screendoor_standard_positions(uint32_t samples) {
    static const int8_t all[2 * 31] = {0, 0, 4, 4, -4, -4, -2, -6, 6, -2, -6, 2, 2, 6, 1, -3, -1, 3,
        5, 1, -3, -5, -5, 5, -7, -1, 3, 7, 7, -7, 1, 1, -1, -3, -3, 2, 4, -1, -5, -2, 2, 5, 5, 3, 3,
        -5, -2, 6, 0, -7, -4, -6, -6, 4, -8, 0, 7, -4, 6, 7, -7, -8};
    if (samples == 0 || samples > 16 || (samples & (samples - 1)) != 0) return NULL;
    return all + 2 * (samples - 1);
}

static bool screendoor_i_header(screendoor_trace *trace, const screendoor_header *header) {
    const int8_t *positions = header->positions;
    const char *texts[3], *names[3] = {"source", "camera", "pattern"}, *fault;
    const uint32_t samples = header->samples;
    char value[1024], *at = value, name[24];
    uint32_t i;
    if (header->width < 1 || header->width > 65536)
        return screendoor_i_fail(trace, "width is %u, not 1 to 65536", (unsigned)header->width);
    if (header->height < 1 || header->height > 65536)
        return screendoor_i_fail(trace, "height is %u, not 1 to 65536", (unsigned)header->height);
    if (samples < 1 || samples > 64 || (samples & (samples - 1)) != 0)
        return screendoor_i_fail(
            trace, "samples is %u, not 1, 2, 4, 8, 16, 32 or 64", (unsigned)samples);
    if (positions == NULL) positions = screendoor_standard_positions(samples);
    if (positions == NULL)
        return screendoor_i_fail(
            trace, "of %u samples there are no standard positions: give yours", (unsigned)samples);
    for (i = 0; i < samples; i++) {
        int x = positions[2 * i], y = positions[2 * i + 1];
        if (x < -8 || x > 7 || y < -8 || y > 7)
            return screendoor_i_fail(
                trace, "position %u is %d,%d, not -8 to 7 sixteenths", (unsigned)i, x, y);
    }
    for (i = 0; i < 3; i++)
        if (!screendoor_i_finite((double)header->background[i]))
            return screendoor_i_fail(trace, "background is not finite");
    fault = header->view == NULL ? NULL : screendoor_i_view_fault(header->view);
    if (fault != NULL) return screendoor_i_fail(trace, "view: %s", fault);
    texts[0] = header->source != NULL ? header->source : "unknown";
    texts[1] = header->camera != NULL ? header->camera : "unknown";
    texts[2] = header->pattern != NULL     ? header->pattern
               : header->positions != NULL ? "custom"
                                           : name;
    snprintf(name, sizeof name, "standard-%u", (unsigned)samples);
    for (i = 0; i < 3; i++)
        if (!screendoor_i_is_utf8(texts[i]) || strlen(texts[i]) > 65536)
            return screendoor_i_fail(trace, "%s is not UTF-8 of up to 65536 bytes", names[i]);

    for (i = 0; i < 3; i++) {
        if (i > 0) *at++ = ' ';
        at = screendoor_i_decimal(at, (double)header->background[i], true);
    }
    screendoor_i_entry(trace, "screendoor.background", value);
    screendoor_i_entry(trace, "screendoor.camera", texts[1]);
    if (trace->sealed) screendoor_i_entry(trace, "screendoor.checksums", "crc32");
    screendoor_i_entry(trace, "screendoor.depth", "unorm32 near=0 far=4294967295 less-equal");
    snprintf(value, sizeof value, "%u", (unsigned)header->height);
    screendoor_i_entry(trace, "screendoor.height", value);
    screendoor_i_entry(trace, "screendoor.nested", header->nested ? "true" : "false");
    screendoor_i_entry(trace, "screendoor.pattern", texts[2]);
    for (i = 0, at = value; i < samples; i++)
        at += snprintf(at, 16, "%s%d,%d", i > 0 ? " " : "", positions[2 * i], positions[2 * i + 1]);
    screendoor_i_entry(trace, "screendoor.positions", value);
    snprintf(value, sizeof value, "%u", (unsigned)samples);
    screendoor_i_entry(trace, "screendoor.samples", value);
    screendoor_i_entry(trace, "screendoor.source", texts[0]);
    if (header->encoded) screendoor_i_entry(trace, "screendoor.space", "encoded");
    screendoor_i_entry(trace, "screendoor.version",
        header->encoded        ? "1.2"
        : header->view != NULL ? "1.1"
                               : "1.0");
    if (header->view != NULL) {
        const screendoor_view *view = header->view;
        const double *matrices[2] = {view->view_to_clip, view->world_to_view};
        screendoor_i_decimal(value, view->far_plane, false);
        screendoor_i_entry(trace, "screendoor.view.far", value);
        screendoor_i_decimal(value, view->near_plane, false);
        screendoor_i_entry(trace, "screendoor.view.near", value);
        screendoor_i_entry(trace, "screendoor.view.projection",
            view->orthographic ? "orthographic" : "perspective");
        for (i = 0; i < 32; i++) {
            if (i % 16 == 0) at = value;
            else *at++ = ' ';
            at = screendoor_i_decimal(at, matrices[i / 16][i % 16], false);
            if (i % 16 == 15)
                screendoor_i_entry(trace,
                    i < 16 ? "screendoor.view.view_to_clip" : "screendoor.view.world_to_view",
                    value);
        }
    }
    snprintf(value, sizeof value, "%u", (unsigned)header->width);
    screendoor_i_entry(trace, "screendoor.width", value);
    return !trace->text.failed || screendoor_i_memory(trace);
}

/* ---- What is called ---- */

screendoor_trace *screendoor_trace_open(const char *path, const screendoor_header *header) {
    screendoor_trace *trace = (screendoor_trace *)calloc(1, sizeof *trace);
    const size_t length = strlen(path == NULL ? "" : path);
    FILE *old;
    size_t i;
    if (trace == NULL) return NULL;
    trace->path = (char *)malloc(2 * length + sizeof "..partial");
    if (trace->path == NULL) return free(trace), (screendoor_trace *)NULL;
    trace->partial = trace->path + length + 1;
    memcpy(trace->path, path == NULL ? "" : path, length + 1);
    memcpy(trace->partial, trace->path, length);
    memcpy(trace->partial + length, ".partial", sizeof ".partial");
    trace->width = header->width, trace->height = header->height;
    trace->samples = header->samples, trace->sealed = !header->unsealed;
    if (length == 0) return screendoor_i_fail(trace, "no path is given"), trace;
    if (!screendoor_i_header(trace, header)) return trace;

    for (i = 0; i < SCREENDOOR_I_COLUMNS; i++) {
        trace->sizes[i] = i < 2 ? 2 : i < 6 || i > 8 || header->float_colours ? 4 : 2;
        if (i == 2) trace->sizes[i] = header->samples <= 8 ? 1 : header->samples / 8;
        trace->columns[i] = (unsigned char *)malloc(SCREENDOOR_I_ROWS * trace->sizes[i]);
        if (trace->columns[i] == NULL) return screendoor_i_memory(trace), trace;
        screendoor_i_hash_init(&trace->hashes[i]);
    }
    for (i = 0; i < 256; i++) {
        uint32_t crc = (uint32_t)i;
        int bit;
        for (bit = 0; bit < 8; bit++) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
        trace->table[i] = crc;
    }
    /* The content: all but the seal's mark and the view, and a version as without one. */
    screendoor_i_hash_init(&trace->header_hash);
    for (i = 0; i < trace->entries; i++) {
        const char *key = trace->keys[i];
        const char *value = (const char *)trace->text.data + trace->values[i];
        if (strcmp(key, "screendoor.checksums") == 0) continue;
        if (strncmp(key, "screendoor.view.", 16) == 0) continue;
        if (strcmp(key, "screendoor.version") == 0 && strcmp(value, "1.1") == 0) value = "1.0";
        screendoor_i_hash_line(&trace->header_hash, key, value);
    }

    /* A folder or a protected file at that place is found now rather than at the end. */
    errno = 0;
    old = fopen(trace->path, "rb+");
    if (old != NULL) fclose(old);
    else if (errno != ENOENT) return screendoor_i_io(trace, "write"), trace;
    trace->file = fopen(trace->partial, "wb");
    if (trace->file == NULL) return screendoor_i_io(trace, "create"), trace;
    trace->begun = true;
    screendoor_i_write(trace, "ARROW1\0", 8);
    screendoor_i_schema(trace, screendoor_i_begin(&trace->message, 1, 0), 2);
    screendoor_i_end(trace);
    screendoor_i_seal(trace, 0);
    return trace;
}

static bool screendoor_i_bad(screendoor_trace *trace, size_t column, const char *what) {
    return screendoor_i_fail(trace, "row %llu, column '%s': %s",
        (unsigned long long)(trace->rows + trace->batch), screendoor_i_names[column], what);
}

static bool screendoor_i_bad_real(
    screendoor_trace *trace, size_t column, float value, const char *rule) {
    char what[128];
    if (!screendoor_i_finite((double)value))
        return screendoor_i_bad(trace, column, "it is not finite");
    strcpy(screendoor_i_decimal(what, (double)value, true), rule);
    return screendoor_i_bad(trace, column, what);
}

bool screendoor_trace_push(screendoor_trace *trace, const screendoor_fragment *fragment) {
    const screendoor_fragment *f = fragment;
    const uint32_t alpha = screendoor_i_bits(f->alpha);
    const float colour[3] = {f->r, f->g, f->b};
    char what[96];
    size_t i, at;
    if (trace == NULL || trace->failed) return false;
    if (trace->closed) return screendoor_i_fail(trace, "it is closed");
    if (f->x >= trace->width || f->y >= trace->height) {
        bool x = f->x >= trace->width;
        snprintf(what, sizeof what, "%u lies outside the frame, which is %u pixels %s",
            (unsigned)(x ? f->x : f->y), (unsigned)(x ? trace->width : trace->height),
            x ? "wide" : "high");
        return screendoor_i_bad(trace, x ? 0 : 1, what);
    }
    if (f->coverage == 0) return screendoor_i_bad(trace, 2, "it is 0: no sample is covered");
    if (trace->samples < 64 && f->coverage >> trace->samples != 0) {
        snprintf(what, sizeof what, "0x%llx has samples that do not exist: a pixel has %u",
            (unsigned long long)f->coverage, (unsigned)trace->samples);
        return screendoor_i_bad(trace, 2, what);
    }
    at = trace->batch;
    for (i = 0; i < 3; i++) {
        const size_t size = trace->sizes[6 + i];
        const uint32_t bits = size == 2 ? screendoor_i_half(colour[i])
                                        : screendoor_i_bits(colour[i]);
        const uint32_t most = size == 2 ? 0x7c00 : 0x7f800000;
        if ((bits & most) == most)
            return screendoor_i_bad_real(
                trace, 6 + i, colour[i], " is beyond 65504: set float_colours");
        if (size == 2) screendoor_i_store(trace->columns[6 + i] + 2 * at, bits, 2);
        else screendoor_i_store(trace->columns[6 + i] + 4 * at, bits, 4);
    }
    if (alpha > 0x3f800000 && alpha != 0x80000000)
        return screendoor_i_bad_real(trace, 9, f->alpha, " is not 0 to 1");
    screendoor_i_store(trace->columns[0] + 2 * at, f->x, 2);
    screendoor_i_store(trace->columns[1] + 2 * at, f->y, 2);
    screendoor_i_store(trace->columns[2] + trace->sizes[2] * at, f->coverage, trace->sizes[2]);
    screendoor_i_store(trace->columns[3] + 4 * at, f->z, 4);
    screendoor_i_store(trace->columns[4] + 4 * at, (uint32_t)f->dzdx, 4);
    screendoor_i_store(trace->columns[5] + 4 * at, (uint32_t)f->dzdy, 4);
    screendoor_i_store(trace->columns[9] + 4 * at, alpha, 4);
    screendoor_i_store(trace->columns[10] + 4 * at, f->primitive, 4);
    screendoor_i_store(trace->columns[11] + 4 * at, f->object, 4);
    return ++trace->batch < SCREENDOOR_I_ROWS || screendoor_i_flush(trace);
}

bool screendoor_trace_push_array(
    screendoor_trace *trace, const screendoor_fragment *fragments, size_t count) {
    size_t i;
    for (i = 0; i < count; i++)
        if (!screendoor_trace_push(trace, &fragments[i])) return false;
    return trace != NULL && !trace->failed;
}

/* Rounded to nearest, halves away from zero. */
static int64_t screendoor_i_whole(double units) {
    int64_t whole = (int64_t)units;
    double rest = units - (double)whole;
    return rest >= 0.5 ? whole + 1 : rest <= -0.5 ? whole - 1 : whole;
}

void screendoor_depth(screendoor_fragment *fragment, float z, float dzdx, float dzdy) {
    /* Volatile: rounded to double precision, and not fused with what follows. */
    volatile double depth, right, down;
    const uint32_t bits = screendoor_i_bits(z);
    const bool no_number = (bits & 0x7fffffff) > 0x7f800000;
    const bool within = bits <= 0x3f800000 || bits == 0x80000000;
    const double most = 2147483647.5;
    bool fits = within && screendoor_i_finite((double)dzdx) && screendoor_i_finite((double)dzdy);
    right = fits ? (double)dzdx * 4294967295.0 : 0.0;
    down = fits ? (double)dzdy * 4294967295.0 : 0.0;
    depth = within ? (double)z * 4294967295.0 : 0.0;
    fits = fits && right > -most && right < most && down > -most && down < most;
    fragment->z = within                         ? (uint32_t)screendoor_i_whole(depth)
                  : no_number || bits >> 31 != 0 ? 0
                                                 : UINT32_MAX;
    fragment->dzdx = fits ? (int32_t)screendoor_i_whole(right) : 0;
    fragment->dzdy = fits ? (int32_t)screendoor_i_whole(down) : 0;
}

static uint32_t screendoor_i_lacks(uint32_t coverage) {
    uint32_t count = 32;
    for (; coverage != 0; coverage &= coverage - 1) count--;
    return count;
}

static int screendoor_i_order(const void *left, const void *right) {
    const screendoor_raw_fragment *a = (const screendoor_raw_fragment *)left;
    const screendoor_raw_fragment *b = (const screendoor_raw_fragment *)right;
    uint32_t c = a->primitive, d = b->primitive;
    if (c == d) c = a->pixel, d = b->pixel;
    if (c == d) c = screendoor_i_lacks(a->coverage), d = screendoor_i_lacks(b->coverage);
    if (c == d) c = a->coverage, d = b->coverage;
    if (c == d) c = screendoor_i_bits(a->z), d = screendoor_i_bits(b->z);
    return c < d ? -1 : c > d ? 1 : memcmp(a, b, sizeof *a);
}

bool screendoor_trace_push_raw(
    screendoor_trace *trace, screendoor_raw_fragment *raw, size_t count) {
    size_t i, next;
    if (trace == NULL || trace->failed) return false;
    if (count > 0) qsort(raw, count, sizeof *raw, screendoor_i_order);
    for (i = 0; i < count; i = next) {
        const uint32_t alpha = screendoor_i_bits(raw[i].alpha);
        screendoor_fragment f;
        f.x = raw[i].pixel & 0xffff, f.y = raw[i].pixel >> 16, f.coverage = raw[i].coverage;
        screendoor_depth(&f, raw[i].z, raw[i].dzdx, raw[i].dzdy);
        f.r = raw[i].red, f.g = raw[i].green, f.b = raw[i].blue;
        f.alpha = raw[i].alpha; /* what is no number stays, and is refused */
        if (alpha > 0x3f800000 && alpha <= 0x7f800000) f.alpha = 1;
        if (alpha > 0x80000000 && alpha <= 0xff800000) f.alpha = 0;
        f.primitive = raw[i].primitive, f.object = raw[i].object;
        for (next = i + 1; next < count && raw[next].primitive == raw[i].primitive &&
                           raw[next].pixel == raw[i].pixel;
            next++)
            f.coverage |= raw[next].coverage;
        if (!screendoor_trace_push(trace, &f)) return false;
    }
    return true;
}

bool screendoor_trace_close(screendoor_trace *trace) {
    FILE *file;
    if (trace == NULL || trace->failed) return false;
    if (trace->closed) return true;
    if (!screendoor_i_flush(trace) || !screendoor_i_tail(trace)) return false;
    file = trace->file, trace->file = NULL;
    if (fflush(file) != 0) {
        screendoor_i_io(trace, "write");
        return fclose(file), false;
    }
    if (fclose(file) != 0) return screendoor_i_io(trace, "write");
    if (rename(trace->partial, trace->path) != 0) {
#ifdef _WIN32
        /* Renaming does not replace there. What is whole is not removed any more: where it
         * cannot have its name it keeps the other one. */
        trace->begun = false;
        if (remove(trace->path) != 0 || rename(trace->partial, trace->path) != 0)
            return screendoor_i_io(trace, "name (the trace is whole, with .partial after its name)");
#else
        return screendoor_i_io(trace, "name");
#endif
    }
    trace->begun = false, trace->closed = true;
    return true;
}

void screendoor_trace_abandon(screendoor_trace *trace) {
    if (trace != NULL && !trace->closed) screendoor_i_fail(trace, "it was abandoned");
}

const char *screendoor_trace_error(const screendoor_trace *trace) {
    return trace == NULL ? "out of memory" : trace->error;
}

void screendoor_trace_free(screendoor_trace *trace) {
    size_t i;
    if (trace == NULL) return;
    screendoor_i_drop(trace);
    for (i = 0; i < SCREENDOOR_I_COLUMNS; i++) free(trace->columns[i]);
    free(trace->text.data), free(trace->message.data);
    free(trace->batches.data), free(trace->seals.data), free(trace->path);
    free(trace);
}

#ifdef _MSC_VER
#pragma warning(pop)
#endif
#endif /* SCREENDOOR_TRACE_IMPLEMENTED */
#endif /* SCREENDOOR_TRACE_IMPLEMENTATION */
