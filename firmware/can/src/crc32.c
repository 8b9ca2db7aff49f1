#include "taper/crc32.h"

/* Remainder of every half byte: sixteen entries, because flash is dearer here than time. */
static const uint32_t crc_table[16] = {
    0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
    0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c,
};

uint32_t taper_crc32(const uint8_t *data, uint32_t length) {
    uint32_t crc = UINT32_MAX;
    for (uint32_t i = 0; i < length; i++) {
        crc ^= data[i];
        crc = (crc >> 4) ^ crc_table[crc & 0xFu];
        crc = (crc >> 4) ^ crc_table[crc & 0xFu];
    }
    return ~crc;
}
