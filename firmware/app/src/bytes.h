/** Private to the app layer: little-endian numbers, byte by byte, so that no compiler's layout gets into what is kept or sent. */
#ifndef TAPER_BYTES_H
#define TAPER_BYTES_H

#include <stdint.h>
#include <string.h>

/** Where the next number goes, or comes from. The caller sees to it that there is room. */
typedef struct {
    uint8_t *at;
} taper_writer_t;

typedef struct {
    const uint8_t *at;
} taper_reader_t;

static inline void taper_put_u8(taper_writer_t *to, uint8_t value) {
    *to->at++ = value;
}

static inline void taper_put_u16(taper_writer_t *to, uint16_t value) {
    taper_put_u8(to, (uint8_t)value);
    taper_put_u8(to, (uint8_t)(value >> 8));
}

static inline void taper_put_u32(taper_writer_t *to, uint32_t value) {
    taper_put_u16(to, (uint16_t)value);
    taper_put_u16(to, (uint16_t)(value >> 16));
}

static inline void taper_put_i32(taper_writer_t *to, int32_t value) {
    taper_put_u32(to, (uint32_t)value);
}

static inline uint8_t taper_get_u8(taper_reader_t *from) {
    return *from->at++;
}

static inline uint16_t taper_get_u16(taper_reader_t *from) {
    const uint16_t low = taper_get_u8(from);
    return (uint16_t)(low | (unsigned)taper_get_u8(from) << 8);
}

static inline uint32_t taper_get_u32(taper_reader_t *from) {
    const uint32_t low = taper_get_u16(from);
    return low | (uint32_t)taper_get_u16(from) << 16;
}

static inline int32_t taper_get_i32(taper_reader_t *from) {
    const uint32_t bits = taper_get_u32(from);
    int32_t value = 0;
    memcpy(&value, &bits, sizeof value); /* two's complement, whatever the compiler makes of a cast */
    return value;
}

#endif
