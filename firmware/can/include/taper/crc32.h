/** CRC-32 of IEEE 802.3: reflected polynomial 0xEDB88320, initial value and final xor 0xFFFFFFFF; zlib's crc32(). */
#ifndef TAPER_CRC32_H
#define TAPER_CRC32_H

#include <stdint.h>

/** @return the CRC of `data`; "123456789" gives 0xCBF43926. Cost: two table look-ups a byte, 64 bytes of table. */
uint32_t taper_crc32(const uint8_t *data, uint32_t length);

#endif
